"""Make the embedded command recogniser: draw sentences, speak them, train, export, judge."""
