"""What is said of several recordings at once."""

from collections.abc import Sequence

from engine_mount.reports.sections.subject import Subject


class Sentences:
    """Collects what is said of each subject; what is true of all of them is said once, without a name."""

    def __init__(self, subjects: Sequence[Subject]):
        self._subjects = subjects
        self._said: list[tuple[str, list[str]]] = []

    def say(self, subject: Subject, text: str) -> None:
        """Say `text`, a sentence that begins small and has no full stop, of `subject`."""
        for known, names in self._said:
            if known == text:
                names.append(subject.name)
                return
        self._said.append((text, [subject.name]))

    def told(self) -> list[str]:
        """Return the sentences, with the names of those they are true of where it is not all."""
        return [
            f'{text[:1].upper()}{text[1:]}.'
            if len(names) == len(self._subjects)
            else f'{", ".join(names)}: {text}.'
            for text, names in self._said
        ]
