"""What images of known or unknown points tell: poses, homographies, points in space."""
