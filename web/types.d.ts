// Types of the messages between the page and its worker, and of files that are bundled as text.

/** `coarse`, `fine` and `full` are stages of a search; `dragged` follows a drag of the outline or of the balance. */
export type Stage = 'coarse' | 'fine' | 'full' | 'dragged';

export type Request =
  | {kind: 'load', seq: number, core: ArrayBuffer}
  /** Points of the outlines, x and y by turns, with y down. */
  | {kind: 'solve', seq: number, source: Float64Array, target: Float64Array, balance: number}
  | {kind: 'balance', seq: number, balance: number}
  | {kind: 'drag', seq: number, centre: number[], by: number[], radius: number};

export interface Figures {
  energy: number;
  /** Share of the area on which lengths change at most by a factor of two. */
  within2: number;
  folds: number;
  triangles: number;
}

export type Answer =
  | {seq: number, stage: Stage, floats: Float32Array, figures: Figures, milliseconds: number}
  | {seq: number, stage: 'done', milliseconds: number}
  | {seq: number, stage: 'error', message: string, milliseconds: number};

/** A shape: its outline, and the canvas of its drawing (left, top, right, bottom), with y down. */
export interface Shape {
  name: string;
  outline: Float64Array;
  box: number[];
}

export interface Picture {
  name: string;
  image: ImageBitmap;
}
