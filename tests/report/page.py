"""A page of the report: a claim, what was measured, pictures; written as Markdown beside its pictures."""

import pathlib


class Skipped(Exception):
    """A page, or a part of one, that lacks what it needs; the text says what."""


def table(head, rows):
    """Markdown; numbers are written with few digits."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(text(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def text(value, digits=3):
    """A number as a table has it, or the words themselves."""
    if isinstance(value, str):
        return value.replace("|", "/")
    if value is None or value != value:
        return "–"
    if isinstance(value, int):
        return f"{value:,}"
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits - 1}e}"
    whole = f"{value:.{digits}g}"
    return f"{value:,.0f}" if "e" in whole or abs(value) >= 10 ** (digits - 1) else whole


class Page:
    """What a page says; `claims` are the lines of its first table, which the list of all pages repeats."""

    def __init__(self, name, title, where, folder):
        self.name, self.title, self.where, self.folder = name, title, where, pathlib.Path(folder)
        self.claims, self.parts, self.note = [], [], None  # note: in place of when and where it was measured

    def claim(self, what, report, ours):
        """What the report has and what is measured here, numbers or words."""
        self.claims.append((what, text(report), text(ours)))

    def say(self, words):
        self.parts.append(words.strip() + "\n")

    def heading(self, words):
        self.parts.append(f"## {words}\n")

    def table(self, head, rows):
        self.parts.append(table(head, rows))

    def skip(self, why):
        """A part that can't be shown here."""
        self.parts.append(f"*skipped: {why}*\n")

    def code(self, lines):
        self.parts.append("```sh\n" + "\n".join(lines) + "\n```\n")

    def picture(self, what, suffix):
        """The file of a picture of this page, and the words for `pictures` to show it by."""
        return self.folder / f"{self.name}-{what}{suffix}"

    def svg(self, what, content, caption):
        path = self.picture(what, ".svg")
        path.write_text(content)
        self.parts.append(f"![{caption}]({path.name})\n")

    def pictures(self, pairs):
        """Pictures [(path, caption), ...] in a row."""
        head = "| " + " | ".join(caption for _, caption in pairs) + " |"
        self.parts.append(
            "\n".join([head, "|" + "---|" * len(pairs), "| " + " | ".join(f"![{c}]({p.name})" for p, c in pairs) + " |"]) + "\n"
        )

    def write(self, note):
        lines = [f"# {self.title}\n", f"*{self.where}.* {self.note or note}\n"]
        if self.claims:
            lines.append(table(("", "FZKA 7190", "Gewebe"), self.claims))
        (self.folder / f"{self.name}.md").write_text("\n".join(lines + self.parts))
