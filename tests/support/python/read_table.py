"""Reads tables of frames with h5py, as any user would.

    read_table.py rows FILE...    the number of rows of each table, a line each
    read_table.py frames FILE     each row as a line of JSON: column to value
    read_table.py facts FILE      what stands beside the rows, as JSON
"""

import json
import sys

import h5py


def plain(value):
    value = value.item()
    if value != value:
        return None  # NaN, which JSON has no word for
    return value.decode() if isinstance(value, bytes) else value


def main():
    what, files = sys.argv[1], sys.argv[2:]
    for name in files:
        with h5py.File(name, "r") as file:
            table = file["frames"]
            if what == "rows":
                print(len(table[:]))
            elif what == "frames":
                for row in table[:]:
                    print(json.dumps({column: plain(row[column]) for column in row.dtype.names}))
            else:
                facts = {key: str(value) for key, value in file.attrs.items()}
                facts["units"] = dict(zip(table.dtype.names, map(str, table.attrs["units"])))
                for key in ("configuration", "pattern"):
                    facts[key] = json.loads(file[key][()])
                print(json.dumps(facts))


main()
