"""One small wrong change of one file, and what it is called."""

import hashlib
from dataclasses import asdict, dataclass, field


@dataclass(frozen=True)
class Mutant:
    """The text from `begin` to `end` of `file` becomes `after`; in C++ `{i}` in it stands for the mutant's number (see switches)."""

    file: str
    line: int
    rule: str
    begin: int
    end: int
    before: str
    after: str
    shown: str
    change: str
    name: str = ""
    functions: tuple = field(default=())  # Python: (first line, last line) of the function it stands in

    @property
    def key(self):
        """A short name of this change of this text."""
        text = f"{self.file}|{self.begin}|{self.rule}|{self.shown}|{self.change}|{self.before}|{self.after}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    @property
    def python(self):
        return self.file.endswith(".py")

    def as_dict(self):
        return asdict(self) | {"key": self.key}


def line_of(text, at):
    return text.count("\n", 0, at) + 1


def shown_line(text, at):
    begin = text.rfind("\n", 0, at) + 1
    end = text.find("\n", at)
    return text[begin : end if end >= 0 else len(text)].strip()
