"""Tables of results. A study leaves each of its tables as studies/results/NAME.json; report.py writes docs/validation.md.

A table is a dict with the keys
  title    its heading
  shows    one sentence: what the table shows, and against which independent truth
  command  what a user types to run it again; empty where no command prints it
  date     of that run, YYYY-MM-DD
  columns  their headings
  rows     lists of cells, which are Markdown text
  notes    up to three sentences: how to read the table, and its limits
"""
import datetime
import json
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "results"
KEYS = ["title", "shows", "command", "date", "columns", "rows", "notes"]


def write(name, *, title, shows, command, columns, rows, notes=(), keyed_by=0):
    """Leaves a table of a study that has just run. For a study that runs in parts, keyed_by=N keeps those rows of the file whose
    first N cells are not those of a new row."""
    rows = [[str(cell) for cell in row] for row in rows]
    file = FOLDER / f"{name}.json"
    if keyed_by and file.exists():
        again = {tuple(row[:keyed_by]) for row in rows}
        rows = [row for row in json.loads(file.read_text())["rows"] if tuple(row[:keyed_by]) not in again] + rows
    table = {"title": title, "shows": shows, "command": command, "date": today(), "columns": list(columns), "rows": rows, "notes": list(notes)}
    check(name, table)
    FOLDER.mkdir(exist_ok=True)
    file.write_text(json_of(table))


def today():
    return datetime.date.today().isoformat()


def read_all():
    """Every table, by name."""
    tables = {file.stem: json.loads(file.read_text()) for file in sorted(FOLDER.glob("*.json"))}
    for name, table in tables.items():
        check(name, table)
    return tables


def check(name, table):
    """Raises ValueError for what is no table."""
    datetime.date.fromisoformat(table["date"])
    cells = [table["title"], table["shows"], table["command"], *table["columns"], *table["notes"], *(c for row in table["rows"] for c in row)]
    if list(table) != KEYS:
        raise ValueError(f"{name}: keys are not {KEYS}")
    if not all(isinstance(cell, str) and "\n" not in cell for cell in cells):
        raise ValueError(f"{name}: a cell is not one line of text")
    if not all(len(row) == len(table["columns"]) for row in table["rows"]):
        raise ValueError(f"{name}: a row does not have {len(table['columns'])} cells")
    if len(table["notes"]) > 3:
        raise ValueError(f"{name}: more than three notes")


def json_of(table):
    """One line a row, so that changes are readable."""
    def listed(values):
        return "[\n" + ",\n".join("  " + json.dumps(v, ensure_ascii=False) for v in values) + "\n ]" if values else "[]"

    lines = [f" {json.dumps(key)}: " + (listed(table[key]) if key in ("rows", "notes") else json.dumps(table[key], ensure_ascii=False)) for key in KEYS]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def markdown(table):
    """The rows as a Markdown table."""
    lines = [table["columns"], ["---"] * len(table["columns"]), *table["rows"]]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)
