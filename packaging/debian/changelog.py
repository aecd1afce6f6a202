#!/usr/bin/python3
"""The package's changelog in Debian's form.

    changelog.py VERSION FOLDER [SOURCE_DATE_EPOCH]

writes FOLDER/share/doc/gonio/changelog.gz.
"""
import email.utils
import gzip
import pathlib
import sys


def main(version, folder, seconds=0):
    date = email.utils.format_datetime(email.utils.datetime.datetime.fromtimestamp(int(seconds), email.utils.datetime.timezone.utc))
    text = (f'gonio ({version}) unstable; urgency=medium\n\n  * CHANGELOG.md, in the same folder, says what is new.\n\n'
            f' -- The Gonio authors <gonio@gonio.invalid>  {date}\n')
    path = pathlib.Path(folder) / 'share/doc/gonio/changelog.gz'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.encode(), 9, mtime=0))


if __name__ == '__main__':
    main(*sys.argv[1:])
