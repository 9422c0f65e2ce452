"""Speed of a stream, as a ratio on the same machine."""

import numpy as np
from helpers.arrays import known_array
from helpers.machine import once, show


def test_a_stream_is_forty_times_faster_than_its_frames_located():
    # One push of 100 frames of 64 sensors at 1 kHz, with a contact: 3 to 5 ms of a core.
    array = known_array(8, 8)
    random = np.random.default_rng(39)
    noise = np.sqrt(array.noise[0, 0]) * random.normal(size=(30, 100, 64))
    touched = array.predict([[0.3e-3, 0.4e-3]], 1.0) + noise[10:]
    stream = array.stream(1000)
    stream.push(np.concatenate(noise[:10]))
    assert stream.push(touched[0])["contact"].all()
    # Every second push ends a block of the filter.
    pushed = once(lambda: [stream.push(block) for block in touched]) / len(touched)
    located = once(lambda: array.locate(touched[0], shear=0.0))
    show("a push into a stream, over locate", pushed / located, 1 / 40)
