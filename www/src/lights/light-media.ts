/** The image or video of the `light-src` attribute. */

import type { CrossOrigin } from '../shared/keywords.js';

const VIDEO_EXTENSION = /\.(mp4|m4v|webm|ogv|mov)$/i;

/** Whether an address is that of a video, judged by its path's extension. */
export function isVideoAddress(address: string): boolean {
  return VIDEO_EXTENSION.test(new URL(address).pathname);
}

/** One address; another address needs another object. */
export class LightMedia {
  readonly source: HTMLImageElement | HTMLVideoElement;
  readonly #video: HTMLVideoElement | null = null;
  #playing = false;

  constructor(
    readonly address: string,
    readonly crossOrigin: CrossOrigin,
  ) {
    if (isVideoAddress(address)) {
      const properties = { muted: true, loop: true, playsInline: true, preload: 'auto' } as const;
      this.#video = Object.assign(document.createElement('video'), properties);
    }
    this.source = this.#video ?? new Image();
    this.source.crossOrigin = crossOrigin;
    this.source.src = address;
  }

  get isVideo(): boolean {
    return this.#video !== null;
  }

  set playing(playing: boolean) {
    if (!this.#video || playing === this.#playing) return;
    this.#playing = playing;
    // A video that cannot play fires an error event; a video that may not play stays at its first frame.
    if (playing) void this.#video.play().catch(() => {});
    else this.#video.pause();
  }

  /** Stops loading and releases the video decoder. */
  release(): void {
    this.source.removeAttribute('src');
    this.#video?.load();
  }
}
