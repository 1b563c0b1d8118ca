"""Files: inputs that are checked, and outputs that appear complete or not at all."""

import errno
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from io import BufferedReader
from itertools import islice
from pathlib import Path
from typing import Any

from .. import progress
from ..errors import InputError, MissingFileError, naming
from . import limits

BLOCK_BYTES = 1 << 16  # written to find out whether the disk is full
MOST_ENTRIES = 10_000
"""Names in a folder that are searched for a similar one, so that an error message never takes long."""
SIMILARITY_RATIO = 0.75
"""Similarity (by `difflib`) of names without suffixes: one or two wrong letters in ten."""
ADDRESS = re.compile(r"(?i)(https?|ftp|file):/")  # one slash, since paths join two into one
SURROGATE_ESCAPE = re.compile(r"\\u[dD][89a-fA-F]")
_unfinished = set[Path]()  # temporary files and folders that exist now
_together: ContextVar[ExitStack | None] = ContextVar(
    "together", default=None
)  # the exit stack of `together`, inside its block
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


@contextmanager
def together() -> Iterator[None]:
    """Let all files that `write_bytes` writes in the block appear when it succeeds, and none of them when it fails."""
    with ExitStack() as stack:
        token = _together.set(stack)
        try:
            yield
        finally:
            _together.reset(token)


@contextmanager
def replacing(path: str | os.PathLike, *, force: bool = False, private: bool = False) -> Iterator[Path]:
    """Yield a temporary file beside `path`, with its suffix, that replaces it when the block succeeds.

    The content is flushed to disk before the file is renamed, so that a crash or a full disk never leaves an incomplete
    file. If the block fails, nothing is left behind, and an existing file is unchanged. The folder is not flushed:
    after a crash, it may still contain the old file.

    Args:
        path: the file to write. A symbolic link is followed: its destination is replaced.
        force: whether an existing file may be replaced.
        private: whether only the user may read it, whatever the umask and the permissions of an existing file.

    Raises:
        InputError: the folder is missing or not writable, `path` is not a plain file, it exists without
            `force`, or the disk is full.
    """
    requested, path = path, check_output(path, force=force)
    temporary = _sibling(path, private)
    try:
        yield temporary
        if not force and path.exists():
            raise InputError(
                f"{path}: another program created this file in the meantime; use --force to replace it"
            )
        _probe(temporary)
        _flush(temporary)
        os.replace(temporary, path)
    except InputError as error:  # errors about the temporary file are reported for the output
        if str(temporary) not in str(error):
            raise
        raise InputError(str(error).replace(str(temporary), str(requested))) from error
    except OSError as error:
        if error.errno in _FULL or error.filename in (str(temporary), temporary):
            raise InputError(f"{path}: cannot write this file: {_reason(error)}") from error
        raise
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        _unfinished.discard(temporary)


@contextmanager
def scratch() -> Iterator[Path]:
    """Yield a temporary folder, which is removed when the block ends."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _unfinished.add(folder)
        yield folder
        _unfinished.discard(folder)


def abandon() -> None:
    """Remove all temporary files and folders before the process is ended inside its `with` blocks."""
    for path in list(_unfinished):
        with suppress(OSError):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


@contextmanager
def writing(name: str, *, force: bool = False, suffix: str = ".png") -> Iterator[Path]:
    """Work like `replacing`, or for `-` yield a file whose content is written to stdout when the block succeeds."""
    if name != "-":
        with replacing(name, force=force) as path:
            yield path
        return
    with scratch() as folder:
        path = folder / f"stdout{suffix}"
        yield path
        progress.tell("")
        with path.open("rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)


def check_output(path: str | os.PathLike, *, force: bool = False) -> Path:
    """Check that an output may be written, and return its real path.

    Raises:
        InputError: the folder is missing or not writable, `path` is not a plain file, or it exists, or is a link to a
            file that does not exist, without `force`.
    """
    path = Path(path)
    try:
        as_text(path)
        real = Path(os.path.realpath(path))
        if real.is_dir():
            raise InputError(f"{path}: is a folder; name a file in it")
        if real.parent.exists() and not real.parent.is_dir():
            raise InputError(f"{path}: {real.parent} is a file, not a folder; choose another folder")
        if not real.parent.is_dir():
            raise InputError(f"{path}: the folder {real.parent} does not exist; create it first")
        if real.exists() and not real.is_file():
            raise InputError(f"{path}: not a plain file; choose another output")
        if real.exists() and not force:
            raise InputError(f"{path}: the file exists; use --force to replace it")
        if path.is_symlink() and not force:
            raise InputError(f"{path}: is a link to {real}; use --force to write to it, or name that file")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path!s}: cannot write this file: {_reason(error)}") from error
    if not os.access(real.parent, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the folder {real.parent} is not writable; choose another folder")
    return real


def relative_path(path: str | os.PathLike, folder: str | os.PathLike) -> str:
    """Return the path of a file relative to a folder; on another drive of Windows, its absolute path."""
    try:
        return os.path.relpath(path, folder)
    except ValueError:
        return os.path.abspath(path)


def common_folder(folders: Iterable[str]) -> str:
    """Return the deepest folder that contains all of these.

    Raises:
        InputError: they are on several drives of Windows.
    """
    folders = list(folders)
    try:
        return os.path.commonpath(folders)
    except ValueError:
        listed = ", ".join(
            sorted({os.path.splitdrive(folder)[0] or "the current drive" for folder in folders})
        )
        raise InputError(
            f"outputs: they are on several drives ({listed}); write all of them to one drive"
        ) from None


def _is_input(output: Path, inputs: Collection[Path]) -> bool:
    """Return whether an output is one of the inputs, also where the system ignores the case of names."""
    if output in inputs:
        return True
    if not output.exists():
        return False
    alike = [path for path in inputs if str(path).casefold() == str(output).casefold()]
    return any(path.exists() and output.samefile(path) for path in alike)


def check_outputs(
    names: Iterable[str],
    inputs: Iterable[str | Path],
    *,
    force: bool,
    taken: Iterable[str] = (),
    replaceable: Collection[str] = (),
) -> None:
    """Check that all outputs may be written, and that none is an input, another output, or in `taken`.

    An existing output is reported last, after other problems; those in `replaceable` may exist.

    Raises:
        InputError: as in `check_output`, or because of a conflict.
    """
    names, inputs = list(names), list(inputs)
    # unlike Path.resolve before Python 3.13, realpath accepts links that form a loop
    input_paths, used = ({Path(os.path.realpath(name)) for name in paths} for paths in (inputs, taken))
    for name in names:
        real = check_output(name, force=True)
        if _is_input(real, input_paths):
            raise InputError(f"{name}: is also an input; choose another output")
        if real in used:
            raise InputError(f"{name}: is used for two outputs; give each a separate name")
        used.add(real)
    for name in names:
        try:
            check_output(name, force=force or name in replaceable)
        except InputError:
            for path in inputs:
                open_input(path)
            raise


def as_text(path: str | os.PathLike) -> str:
    """Return the name of a file as text, for libraries that do not accept bytes.

    Raises:
        InputError: the name is not UTF-8, which Linux allows.
    """
    name = os.fspath(path)
    try:
        name.encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{name}: the name is not UTF-8; rename the file") from error
    return name


def open_input(path: str | os.PathLike, *, max_bytes: int | None = None) -> Path:
    """Return the path of an input that exists, is a plain file, can be read, and is not larger than `max_bytes`.

    Raises:
        InputError: otherwise.
    """
    with opened(path, max_bytes=max_bytes):
        return Path(path)


def similar_name(path: Path) -> str:
    """Return a hint with the most similar name in the same folder, or an empty text."""
    from difflib import get_close_matches

    try:
        with os.scandir(path.parent) as entries:
            names = [entry.name for entry in islice(entries, MOST_ENTRIES)]
    except OSError:
        return ""
    stems = get_close_matches(path.stem, {Path(name).stem for name in names}, 1, SIMILARITY_RATIO)
    same_stem = [name for name in names if Path(name).stem in stems]
    similar = get_close_matches(path.name, same_stem, 1, 0)
    return f"; did you mean {path.with_name(similar[0])}?" if similar else ""


@contextmanager
def opened(path: str | os.PathLike, *, max_bytes: int | None = None) -> Iterator[BufferedReader]:
    """Open an input for the duration of a `with` block.

    Raises:
        InputError: as in `open_input`.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file in it")
        if not path.is_file():
            raise InputError(f"{path}: is not a plain file")
        file = path.open("rb")
    except FileNotFoundError as error:
        if ADDRESS.match(str(path)):
            raise InputError(f"{path}: is an address, not a file; download it, and name the file") from error
        raise MissingFileError(f"{path}: no such file{similar_name(path)}") from error
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: cannot read this file: {_reason(error)}") from error
    with file:
        if max_bytes is not None and size > max_bytes:
            raise InputError(f"{path}: the file has {size} bytes, more than the limit of {max_bytes}")
        yield file


def read_bytes(path: str | os.PathLike, *, max_bytes: int) -> bytes:
    """Return the content of an input of at most `max_bytes`.

    Raises:
        InputError: as in `open_input`, or the file is empty.
    """
    with opened(path, max_bytes=max_bytes) as file:
        size = min(os.fstat(file.fileno()).st_size, max_bytes)
        content = file.read(size + 1)  # reserves that much memory
        if len(content) > size:  # the size has changed, or is reported wrongly (/proc)
            content += file.read(max_bytes + 1 - len(content))
    if len(content) > max_bytes:
        raise InputError(f"{path}: the file has more than {max_bytes} bytes, which is the limit")
    if not content:
        raise InputError(f"{path}: the file is empty")
    return content


def parse_json(data: str | bytes, *, once: bool = False) -> Any:
    """Parse JSON; with `once`, the keys of each object must be different.

    Raises:
        InputError: it is not valid JSON, or contains text that cannot be encoded. The message has no file name.
    """
    try:
        text = data if isinstance(data, str) else data.decode(json.detect_encoding(data))
        content = json.loads(text, object_pairs_hook=distinct_keys if once else None)
        if _exceeds_depth(content, limits.JSON_DEPTH):
            raise InputError(f"is nested more than {limits.JSON_DEPTH} deep")
        if SURROGATE_ESCAPE.search(text):  # rare; the full check takes as long as parsing
            _check_surrogates(content)
        return content
    except InputError:
        raise
    except RecursionError:
        raise InputError(f"is nested more than {limits.JSON_DEPTH} deep") from None
    except ValueError as error:  # also for numbers of thousands of digits
        raise InputError(f"not valid JSON: {str(error).splitlines()[0]}") from None


def _exceeds_depth(content: Any, most: int) -> bool:
    """Return whether lists and objects are nested more than `most` deep."""
    containers = [content] if isinstance(content, dict | list) else []
    for _ in range(most):
        containers = [
            child
            for item in containers
            for child in (item.values() if isinstance(item, dict) else item)
            if isinstance(child, dict | list)
        ]
        if not containers:
            return False
    return bool(containers)


def _check_surrogates(content: Any) -> None:
    """Check that parsed JSON has no half of a surrogate pair, such as a lone "\\ud800", which UTF-8 cannot encode.

    Raises:
        InputError: it has.
    """
    try:
        json.dumps(content, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        half = ascii(error.object[error.start])[1:-1]
        raise InputError(f"holds {half}, half of a surrogate pair, which is not a character") from None


def distinct_keys(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object whose keys are all different, since the meaning of repeated keys is not defined in JSON.

    Raises:
        InputError: a key occurs twice.
    """
    result: dict[str, Any] = {}
    for key, value in items:
        if key in result:
            raise InputError(f"the key {key[:60]!r} is given twice in one object")
        result[key] = value
    return result


def read_json(path: str | os.PathLike, *, max_bytes: int) -> Any:
    """Read and parse a JSON file.

    Raises:
        InputError: as in `read_bytes` and `parse_json`.
    """
    data = read_bytes(path, max_bytes=max_bytes)
    with naming(path):
        return parse_json(data)


def write_bytes(
    path: str | os.PathLike, content: bytes, *, force: bool = False, private: bool = False
) -> None:
    """Write a file, inside of `together` at the end of its block; arguments and errors as in `replacing`."""
    stack = _together.get()
    if stack is not None:
        stack.enter_context(replacing(path, force=force, private=private)).write_bytes(content)
        return
    with replacing(path, force=force, private=private) as temporary:
        temporary.write_bytes(content)


def sha256(path: str | os.PathLike) -> str:
    """Return the SHA-256 hash of the content as 64 hexadecimal digits.

    Raises:
        InputError: the file is missing or cannot be read.
    """
    with opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _sibling(path: Path, private: bool) -> Path:
    """Create an empty temporary file beside `path`, because renaming is atomic only within one file system."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem[:32]}.", suffix=path.suffix, dir=path.parent)
        _unfinished.add(Path(name))
        os.close(handle)
        if not private:  # mkstemp already makes private files
            os.chmod(name, path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask())
    except OSError as error:
        raise InputError(f"{path}: cannot write this file: {_reason(error)}") from error
    return Path(name)


def make_folder(path: Path) -> None:
    """Create a folder and its parents if they do not exist.

    Raises:
        InputError: it cannot be created.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot create this folder: {error.strerror}") from error


def make_private_folder(path: Path, top: Path) -> None:
    """Create a folder that only the user can access, whatever the umask, together with all folders from `top` down to
    it.

    Existing folders are made private, too.

    Raises:
        InputError: one cannot be created, or belongs to another user.
    """
    between = [top, *(top / part for part in _prefixes(path.relative_to(top)))]
    try:
        top.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        for folder in between:
            folder.mkdir(mode=0o700, exist_ok=True)
            if os.name != "nt" and folder.stat().st_mode & 0o077:
                folder.chmod(0o700)
    except OSError as error:
        raise InputError(
            f"{error.filename or path}: cannot create a private folder: {error.strerror}"
        ) from error


def _prefixes(path: Path) -> list[Path]:
    """Return the prefixes of a relative path, ending with the path itself."""
    return [Path(*path.parts[:count]) for count in range(1, len(path.parts) + 1)]


def sweep(paths: Iterable[str | os.PathLike]) -> list[Path]:
    """Remove temporary files for these paths that were left by killed processes; each folder is searched once."""
    folders: dict[Path, set[tuple[str, str]]] = {}
    for path in map(Path, paths):
        folders.setdefault(path.parent, set()).add((path.stem[:32], path.suffix))
    removed = []
    for folder, stems_and_suffixes in folders.items():
        with suppress(OSError):
            for entry in list(folder.iterdir()):
                if any((match[1], match[2]) in stems_and_suffixes for match in _temporary(entry.name)):
                    with suppress(OSError):
                        entry.unlink()
                        removed.append(entry)
    return removed


def _temporary(name: str) -> list[re.Match[str]]:
    """Parse the name of a temporary file: the beginning of the stem, and the suffix."""
    forms = (r"\.(.*)\.[a-z0-9_]{8}(\.[^.]+)", r"\.(.*)\.[a-z0-9_]{8}()")
    return [match for form in forms if (match := re.fullmatch(form, name, re.DOTALL))]


def _umask() -> int:
    mask = os.umask(0o077)  # the only portable way to ask
    os.umask(mask)
    return mask


def _probe(path: Path) -> None:
    """Fail if the disk is full, by writing another block: image libraries truncate files without an error."""
    with path.open("r+b", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            if file.write(bytes(BLOCK_BYTES)) != BLOCK_BYTES:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        finally:
            file.truncate(size)


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error).replace("\n", " ")
