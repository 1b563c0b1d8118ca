// Types of the messages between the page and its worker, and of files that are bundled as text.

import type {Pin} from '../io/edit/page/types.d.ts';

/**
 * `coarse`, `fine` and `full` are stages of a search; `live` follows a drag of the outline, of a pin or of the balance, and
 * ends with `full`; `other` is the map of a quiet search, to compare.
 */
export type Stage = 'coarse' | 'fine' | 'full' | 'live' | 'other';

/** What the user can change while the shapes stay. */
export interface Wishes {
  balance: number;
  /** Four numbers for each pin, its point in the source and its place in the target, with y down. */
  pins: Float64Array;
}

export type Request =
  | {kind: 'load', seq: number, core: ArrayBuffer}
  /** Search for a map. Points of the outlines are x and y by turns, with y down. If `quiet`, the present map stays the one that is continued. */
  | {kind: 'solve', seq: number, source: Float64Array, target: Float64Array, quiet: boolean} & Wishes
  /** Let the last map follow other wishes. */
  | {kind: 'follow', seq: number} & Wishes
  /** Let the last map follow its target, of which a part is moved. */
  | {kind: 'drag', seq: number, centre: number[], by: number[], radius: number} & Wishes
  /** Return the last map as a full one; after it has converged, if `settle`, else as it is. */
  | {kind: 'finish', seq: number, settle: boolean} & Wishes
  /** Continue with a map of another worker. */
  | {kind: 'resume', seq: number, state: MapState};

/** A similarity without rotation to coordinates in which a shape has area one and its centroid at 0. */
export interface Frame {
  x: number;
  y: number;
  scale: number;
}

/** An outline of a map, in unit coordinates. */
export interface OutlineState {
  z: Float64Array;
  origins: Float64Array;
  vertices: number[];
}

/** A map in the form in which it is sent to another worker, in unit coordinates. */
export interface MapState {
  frames: Record<'source' | 'target', Frame>;
  source: OutlineState;
  target: OutlineState;
  pairs: {s: Float64Array, tau: Float64Array, atSource: Uint8Array, atTarget: Uint8Array};
  mesh: {z: Float64Array, u: Float64Array, faces: Int32Array};
  theta: number;
  /** By which the springs of pins are stiffer, so that these are met. */
  factors: Float64Array;
}

/** A map in the coordinates of the drawings, with y up, as files of maps have it. */
export interface WholeMap {
  source: Float64Array;
  image: Float64Array;
  faces: Int32Array;
  /** Number of the first vertices, which are the outline in order. */
  border: number;
  energy: number;
}

export interface Figures {
  /** Of the distortion, without the springs of pins. */
  energy: number;
  /** Share of the area on which lengths change at most by a factor of two. */
  within2: number;
  folds: number;
  triangles: number;
  /** Numbers of the pins that miss their places, from 0. */
  missed: number[];
}

/** `map` comes with full maps, `state` with maps that can be continued; `isStill` once no step moves a live map visibly. */
export interface Shown {
  seq: number;
  stage: Stage;
  floats: Float32Array;
  figures: Figures;
  milliseconds: number;
  map?: WholeMap;
  state?: MapState;
  isStill: boolean;
}

export type Answer =
  | Shown
  | {seq: number, stage: 'done', milliseconds: number}
  | {seq: number, stage: 'error', message: string, milliseconds: number};

/** A shape: its outline, and the canvas of its drawing (left, top, right, bottom), with y down. */
export interface Shape {
  name: string;
  outline: Float64Array;
  box: number[];
  /** The whole drawing; missing for shapes that were drawn by hand or dragged. */
  drawing?: string;
  /** What else the drawing has, which the page does not map: holes of the outline, and other parts. */
  left?: {holes: number, parts: number};
}

export interface Picture {
  name: string;
  image: ImageBitmap;
}

/** A state of the page that undo returns to. */
export interface Step {
  picture: Picture;
  source: Shape;
  target: Shape;
  /** Values of the controls by their ids. */
  values: Record<string, string>;
  pins: Pin[];
  /** The map that is seen, converged or not; null before the first one. */
  shown: Shown | null;
  /** Whether the command finds this map from scratch. */
  isFound: boolean;
}
