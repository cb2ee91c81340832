"""Group the errors of the interface builder by who can do something about them.

InterfaceBuildError
├── DefinitionsInvalid   a package folder, or a definition in it, cannot be used: mend the file
├── BuildToolMissing     a compiler, a header or a wheel is not installed: install it
└── CompilationFailed    the compiler or the linker refused generated code: its own words are told
"""


class InterfaceBuildError(Exception):
    """Base of everything that the builder raises."""


class DefinitionsInvalid(InterfaceBuildError):
    """Say which file is wrong, and how."""


class BuildToolMissing(InterfaceBuildError):
    """Say what is not installed, where it was looked for, and the command that installs it."""


class CompilationFailed(InterfaceBuildError):
    """Hold the command that failed and the end of what it wrote."""
