"""Train the embedded command parser: phrases, network, export, judgement."""
