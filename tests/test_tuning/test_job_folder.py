"""Who works on a job's folder, and what is told where it cannot be written."""

import fcntl
import os
import threading

import pytest

from scenarios.errors import InputError
from tuning.job_folder import JOB, LOCK, holder, locked, storing


def test_who_works_on_a_folder_is_told_and_nobody_once_it_is_done(tmp_path):
    assert holder(tmp_path) is None
    with locked(tmp_path):
        assert holder(tmp_path) == str(os.getpid())
    assert holder(tmp_path) is None


def test_a_look_at_the_lock_keeps_nobody_from_taking_it(tmp_path):
    """The look is held for 50 ms, much longer than one lasts."""
    with open(tmp_path / LOCK, "w", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        threading.Timer(0.05, fcntl.flock, (file, fcntl.LOCK_UN)).start()
        with locked(tmp_path):
            assert holder(tmp_path) == str(os.getpid())


@pytest.mark.parametrize(("begun", "remedy"), [(True, "then go on: adwa tune resume "),
                                               (False, "or name another folder, then run the job again")])
def test_only_a_job_that_has_begun_is_gone_on_with(tmp_path, begun, remedy):
    if begun:
        (tmp_path / JOB).touch()
    with pytest.raises(InputError, match=f"{tmp_path}: Permission denied; .*{remedy}"), storing(tmp_path):
        raise PermissionError(13, "Permission denied")
