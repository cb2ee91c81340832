"""Say why a camera could not be calibrated.

CalibrationError
  BadImages            the images show too little: take others
  ImplausibleResult    a result came out that no such camera has: check board and images
"""


class CalibrationError(Exception):
    """Be the root of what calibrating a camera may end in."""


class BadImages(CalibrationError):
    """The images show too little of the board, or always the same; take others."""


class ImplausibleResult(CalibrationError):
    """What came out cannot be true, or is too uncertain; check the board's size and the images."""
