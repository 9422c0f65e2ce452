"""Quality checks and messages: how they are worded, numbered and stored."""

from __future__ import annotations

import json

from memscal import Message
from memscal.model.checks import (
    check,
    failed_check_messages,
    messages_from_json,
    messages_to_json,
)


def test_each_failed_check_gives_one_warning_that_names_value_and_limit() -> None:
    checks = [check("force_12", 4.0, 3.0, "Why."), check("noise", 1.5, 1.5, "")]
    (message,) = failed_check_messages(checks)
    assert str(message) == "Quality check force_12 failed: 4 exceeds 3. Why."
    assert (message.kind, message.severity) == ("failed_check", "warning")
    assert [(each.kind, each.profile) for each in checks] == [("force", "12"), ("noise", "")]


def test_messages_come_back_from_json_and_the_texts_of_older_files_are_notes() -> None:
    messages = (Message("outlier", "x = 2 mm"), Message("failed_check", "y", "warning"))
    assert messages_from_json(json.loads(json.dumps(messages_to_json(messages)))) == messages
    assert messages_from_json(["old"]) == (Message("note", "old"),)
    odd = [7, {"severity": "fatal", "text": ["z"]}, {}]
    texts = [(each.kind, each.text, each.severity) for each in messages_from_json(odd)]
    assert texts == [("note", "7", "note"), ("note", "['z']", "note"), ("note", "", "note")]
