"""Group what can be wrong with platform profiles.

ProfileError    the profile is missing or has faults: edit the file named in the message
"""


class ProfileError(Exception):
    """Report every fault of one profile, a line each."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults
