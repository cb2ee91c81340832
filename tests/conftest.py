pytest_plugins = ["sim_twin.pytest_plugin"]
