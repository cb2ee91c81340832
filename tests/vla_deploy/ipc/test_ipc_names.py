import inspect

from vla_deploy import ipc


def test_all_lists_every_public_name():
    exported = {
        name
        for name, value in vars(ipc).items()
        if not name.startswith("_") and not inspect.ismodule(value)
    }
    assert len(ipc.__all__) == len(set(ipc.__all__))
    assert set(ipc.__all__) == exported
