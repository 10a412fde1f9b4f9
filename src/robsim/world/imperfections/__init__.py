"""The imperfections of images and joints: declared kinds, one file each."""
