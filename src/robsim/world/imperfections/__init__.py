"""The imperfections of images and joints; each file declares one kind."""
