"""Print the version of EGL; a script of its own, which fails where nothing can be drawn."""

import ctypes
import sys
from typing import Final

LIBRARY: Final = "libEGL.so.1"
_SURFACELESS: Final = 0x31DD  # EGL_PLATFORM_SURFACELESS_MESA
_EXTENSION: Final = b"eglGetPlatformDisplayEXT"


def main() -> int:
    """Return 0 and print the version where a display opens."""
    try:
        library = ctypes.CDLL(LIBRARY)
    except OSError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    major, minor = ctypes.c_int(), ctypes.c_int()
    for display in _displays(library):
        pointers = ctypes.byref(major), ctypes.byref(minor)
        if display and library.eglInitialize(ctypes.c_void_p(display), *pointers):
            sys.stdout.write(f"EGL {major.value}.{minor.value}\n")
            return 0
    sys.stderr.write("no EGL display opens\n")
    return 1


def _displays(library: ctypes.CDLL) -> tuple[int | None, ...]:
    library.eglGetDisplay.restype = ctypes.c_void_p
    library.eglGetProcAddress.restype = ctypes.c_void_p
    platform = library.eglGetProcAddress(_EXTENSION)
    default = library.eglGetDisplay(None)
    if not platform:
        return (default,)
    opener = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)
    return opener(platform)(_SURFACELESS, None, None), default


if __name__ == "__main__":
    sys.exit(main())
