"""Write the answer to a command as the model is to write it."""

from collections.abc import Sequence

from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, Step, field_names


def answer_text(steps: Sequence[Step]) -> str:
    """Return steps as the model writes them: fields in their order, no spaces between.

    Raises:
        KeyError: a step lacks a field that it must have, or is none.
    """
    return '{"steps":[' + ",".join(map(_step_text, steps)) + "]}"


def _step_text(step: Step) -> str:
    fields = [f'"do":"{step["do"]}"']
    for name, is_needed in field_names(step["do"]):
        if is_needed or name in step:
            space = " " if name in COPIED_FIELDS else ""
            fields.append(f'"{name}":"{space}{step[name]}"')
    return "{" + ",".join(fields) + "}"
