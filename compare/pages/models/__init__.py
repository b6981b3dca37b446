"""Pages of studies that ask every model which reads a scene."""
