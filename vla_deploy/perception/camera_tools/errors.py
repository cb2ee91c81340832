"""Errors of camera calibration.

CalibrationError
  BadImages            the images show too little: take others
  ImplausibleResult    the result cannot be true: check board and images
"""


class CalibrationError(Exception):
    """A camera could not be calibrated."""


class BadImages(CalibrationError):
    """The images show too little of the board, or always the same; take others."""


class ImplausibleResult(CalibrationError):
    """The result cannot be true, or is too uncertain; check the board's size and the images."""
