from vla_deploy.speech.stop_words.suspicions import alone


def test_at_low_a_word_must_clearly_pass_its_threshold_to_stop_by_itself() -> None:
    assert alone("normal", 0.6) == 0.6
    assert 0.64 < alone("low", 0.64) < 0.9
    assert alone("low", 0.99) <= 1.0
