// The scene of a live run: the replay of the report's page, with one frame that changes.

class LiveScene {
  constructor(section, outline) {
    const parts = outline.parts.length;
    this.frames = {
      count: 0, parts, t: new Float32Array(1), angles: new Float32Array(7), fingers: new Float32Array(2), poses: new Float32Array(7 * parts),
    };
    Object.assign(this, { section, outline, replay: null });
    section.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
      this.replay?.choose(button.dataset.view);
    }));
  }

  take({ poses }) {
    if (!poses.length) return;
    const { frames } = this;
    frames.angles.set(poses.slice(0, 7));
    frames.fingers.set(poses.slice(7, 9));
    frames.poses.set(poses.slice(9, 9 + 7 * frames.parts));
    frames.count = 1;
  }

  show() {
    if (this.frames.count === 0 || this.broken) return;
    try {
      // The camera frames the parts as they stand in the first frame.
      this.replay ??= new Replay(this.section.querySelector(".view"), this.outline, this.frames, []);
      this.replay.show(0);
    } catch (error) {
      this.broken = true;
      this.section.querySelector(".view").replaceChildren(make("p", `This browser cannot draw the 3-D view (${error.message}).`));
    }
  }
}
