import pytest

from benchmarks import speech, speech_words


def test_words_give_the_figures_of_the_whole_and_others_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[dict[str, int]] = []

    def words(**options: int) -> dict[str, float]:
        asked.append(options)
        return {"wer_10db": 0.04}

    monkeypatch.setattr(speech_words, "measure", words)
    report = speech.measure(["words"], {"words": {"sentences": 3, "seed": 1}})
    assert report == {"parts": ["words"], "wer_10db": 0.04}
    assert asked == [{"sentences": 3, "seed": 1}]


def test_a_part_that_does_not_exist_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        speech.main(["--part", "nothing"])
    assert "invalid choice" in capsys.readouterr().err
