import errno
import subprocess
import sys

import pytest

import farm_ar.cli.inputs
from farm_ar import __version__
from farm_ar.cli import main
from farm_ar.errors import MissingPackageError, SceneError


def in_a_process(
    *arguments: str, program: tuple[str, ...] = ("-m", "farm_ar")
) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_python_m_farm_ar_is_the_program():
    result = in_a_process("--version")
    assert (result.returncode, result.stdout, result.stderr) == (0, f"farm-ar {__version__}\n", "")


def test_main_ends_the_process_with_the_exit_code(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["farm-ar", "--version"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    assert capsys.readouterr().out == f"farm-ar {__version__}\n"


def test_help_names_every_command_and_loads_nothing_heavy():
    # Gymnasium, with which the package registers, brings numpy.
    heavy = ("cv2", "matplotlib", "numba", "ortools", "pymunk", "rich", "scipy", "torch")
    program = (
        "import sys\n"
        "from farm_ar.cli import main\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        f"    print('loaded:', *[name for name in {heavy} if name in sys.modules])\n"
    )
    result = in_a_process("--help", program=("-c", program))
    assert result.returncode == 0
    assert all(
        f"\n  {command} " in result.stdout
        for command in (
            *(
                "demo",
                "design",
                "evaluate",
                "identify",
                "play",
                "play-script",
                "plot",
                "replay",
                "reproduce",
                "scenes",
            ),
            *("stress", "stress-replay", "sweeps", "train", "watch"),
        )
    )
    assert result.stdout.endswith("loaded:\n")


@pytest.mark.parametrize("ending", [[], ["--json"]])
def test_a_reader_who_goes_away_is_no_error_message(before, seen, monkeypatch, ending):
    monkeypatch.delenv(
        "PYTHONUNBUFFERED", raising=False
    )  # it is at the end that a buffer is found undelivered
    command = [sys.executable, "-m", "farm_ar", "identify", "--scene", before, "--snapshot", seen, *ending]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    with process:
        assert process.stderr.read() == b""


def test_signs_that_the_encoding_lacks_are_replaced(monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    result = in_a_process("scenes", "list")
    assert result.returncode == 0
    assert "25 m?" in result.stdout


@pytest.mark.parametrize(
    ("problem", "line"),
    [
        (
            SceneError("sites[1]", "must not be there", 3, "a.json"),
            "SceneError: a.json: sites[1]: must not be there, got 3",
        ),
        (
            MissingPackageError("needs torch: pip install farm-ar[train]"),
            "MissingPackageError: needs torch: pip install farm-ar[train]",
        ),
    ],
)
def test_a_mistake_is_one_line_with_its_name(mistake, monkeypatch, problem, line):
    def fail(name):
        raise problem

    monkeypatch.setattr(farm_ar.cli.inputs, "builtin_scene", fail)
    assert mistake("scenes", "show", "farm") == line


def test_an_interruption_is_one_line(run, monkeypatch):
    def interrupt(name):
        raise KeyboardInterrupt

    monkeypatch.setattr(farm_ar.cli.inputs, "builtin_scene", interrupt)
    result = run("scenes", "show", "farm")
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "Interrupted.\n")


def test_an_error_of_ours_keeps_its_traceback(run, monkeypatch):
    def fail(name):
        raise ZeroDivisionError

    monkeypatch.setattr(farm_ar.cli.inputs, "builtin_scene", fail)
    with pytest.raises(ZeroDivisionError):
        run("scenes", "show", "farm")


@pytest.mark.parametrize(
    "arguments", [["nonsense"], ["scenes", "nonsense"], ["identify", "--nonsense"], ["identify"]]
)
def test_a_misused_command_is_refused_in_one_line(mistake, arguments):
    line = mistake(*arguments)
    assert line.startswith("Error: ")
    assert line.endswith("--help'.")
    assert line.isascii()


def test_what_the_operating_system_refuses_is_one_line(mistake, monkeypatch):
    def fail(name):
        raise OSError(errno.ENOSPC, "No space left on device", "a\x1b[31m.mp4")

    monkeypatch.setattr(farm_ar.cli.inputs, "builtin_scene", fail)
    assert mistake("scenes", "show", "farm") == (
        r"OSError: [Errno 28] No space left on device: 'a\x1b[31m.mp4'"
    )


def test_no_error_steers_the_terminal(mistake, monkeypatch):
    def fail(name):
        raise SceneError("a\x1b[31m", "must be one of \x07, \u202e", "b\n", "c\r.json")

    monkeypatch.setattr(farm_ar.cli.inputs, "builtin_scene", fail)
    assert mistake("scenes", "show", "farm") == (
        r"SceneError: c\r.json: a\x1b[31m: must be one of \x07, \u202e, got 'b\n'"
    )
