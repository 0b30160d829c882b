"""Animated WebP."""

from pathlib import Path

import numpy as np
from PIL import Image  # comes with imageio


class WebpWriter:
    """Writes an animated WebP that repeats for ever; used like imageio's writers.

    fade: frames at the end that blend into the first ones, so that the repetition shows no cut.
    """

    def __init__(self, path: Path, *, fps: int, quality: int, fade: int):
        self.path, self.fps, self.quality, self.fade = path, fps, quality, fade
        self.images: list[np.ndarray] = []

    def __enter__(self) -> "WebpWriter":
        return self

    def append_data(self, image: np.ndarray) -> None:
        self.images.append(image)

    def __exit__(self, kind, *_) -> None:
        if kind is not None or not self.images:
            return
        fade = min(self.fade, len(self.images) // 2)
        weights = (np.arange(fade) + 1) / (fade + 1)
        tail = self.images[len(self.images) - fade :]
        blended = [((1 - w) * old + w * new).astype(np.uint8) for w, old, new in zip(weights, tail, self.images)]
        shown = [Image.fromarray(image) for image in self.images[fade : len(self.images) - fade] + blended]
        options = {"duration": 1000 // self.fps, "loop": 0, "quality": self.quality, "method": 6}
        shown[0].save(self.path, save_all=True, append_images=shown[1:], **options)
