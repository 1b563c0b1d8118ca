// The data that the page and the server exchange (see io/edit/messages.py and io/edit/session.py), for type checks.

export type Side = 'source' | 'target';

/** What a click and a drag on a shape do. */
export type Tool = 'pin' | 'pair' | 'stroke' | 'select';

/** Coordinates of the page: [x, y] with y down, or [x, y, z] on the surface of a mesh. */
export type Point = number[];

/** A place as the file has it: coordinates, or the name of a vertex of a mesh, such as `v5`. */
export type Place = number[] | string;

/** Left, top, right and bottom. */
export type Box = number[];

export interface Pin {
  name: string;
  weight: number;
  source: Place;
  target: Place;
  /** Degrees by which the patch around it is rotated; null where that is free. */
  turn: number | null;
  /** Of the patch, in the source's units; 0 for an exact pin; null or missing where it is chosen. */
  radius?: number | null;
  /** How far it may miss its place, in the target's units; null or missing where that is chosen. */
  tolerance?: number | null;
  /** Of the patch, relative to the mean scale of the map; null or missing where it is free. */
  scale?: number | null;
}

/** What is said of a pin beside its places. */
export type PinSettings = Partial<Pick<Pin, 'radius' | 'tolerance' | 'turn' | 'scale'>>;

/** The patch of a soft pin as the map has it, in the units of the files. */
export interface Patch {
  radius: number;
  tolerance: number;
}

export interface Stroke {
  name: string;
  weight: number;
  source: Place[];
  target: Place[];
  ends: string;
  /** Of the band around it that keeps its form, in the source's units; missing where there is none. */
  width?: number;
}

/** What is edited. A rigid region is a polygon, or the name of an element of the drawing. */
export interface Scene {
  pins: Pin[];
  strokes: Stroke[];
  rigid: (string | Place[])[];
  balance: number;
  turn: number | 'any';
  fit: string;
}

/** One entry of a scene; of a stroke also one of its points. */
export interface Item {
  kind: 'pins' | 'strokes' | 'rigid' | 'suggested';
  number: number;
  point?: number;
}

/** A rigid region of a map, with its outlines in the coordinates of the page. */
export interface Region {
  dilatation: number;
  scale: number;
  source: Point[];
  target: Point[];
}

/** Numbers of pins and strokes that the map does not meet. */
export interface Wrong {
  pins?: number[];
  strokes?: number[];
}

export interface ShapeInfo {
  name: string;
  origin: number[];
  scale: number;
  signs: number[];
  outline: Point[];
  holes: Point[][];
  /** The outlines of what a whole drawing paints; then `outline` is the frame around it. */
  painted: Point[][] | null;
  box: Box;
  bounds: Box;
  canvas: Box;
  mesh: boolean;
  /** Of a mesh: right, up and towards the viewer, row by row. */
  axes: number[];
  corners?: Point[];
  axis?: number | null;
}

/** The server's first message. */
export interface Hello {
  type: 'hello';
  empty?: boolean;
  source: ShapeInfo;
  target: ShapeInfo;
  scene: Scene;
  saved: Scene;
  left: Scene | null;
  notes: string[];
  edge: string;
  filter: string;
  holes: boolean;
  digits: number;
  mean: number;
  deforming: boolean;
  drawn: boolean;
  constraints: string;
  picture: string;
  ending: string;
  /** The command that opens the same files again. */
  restart: string;
}

/** The figures of a map, as the report has them. */
export interface Figures {
  stretch?: {p50: number, p95: number, max: number};
  dilatation?: {median: number, p95: number, max: number};
  scale?: {within2: number};
  boundary?: {hausdorff: number};
  injective?: {certified: boolean, share: number};
  turn?: number;
  left_out?: number;
  uncovered?: number;
  shown?: number;
  covered?: number;
  regions?: Region[];
  notes?: string[];
}

/** A map, or why there is none. */
export interface MapMessage {
  type: 'map';
  kind: 'coarse' | 'full' | 'error';
  seq: number;
  ok: boolean;
  message: string;
  figures: Figures;
  wrong: Wrong;
  outlines?: Point[][];
  /** Of each pin; null for exact ones. */
  patches?: (Patch | null)[];
  other?: string;
  command?: string;
}

/** The server serves another tab now. */
export interface TakenMessage {
  type: 'taken';
}

export interface ErrorMessage {
  type: 'error';
  message: string;
}

/** The answer to a question of the page. */
export interface Answer {
  error?: string;
  points?: Place[];
  pins?: Pin[];
  exists?: string[];
  written?: string[];
  command?: string;
  message?: string;
  notes?: string[];
  text?: string;
  name?: string;
}

/** How a texture lies in the plane, and what is beyond it. */
export interface Look {
  box: Box;
  edge: string;
  filter: string;
}

/** What is painted over the texture, and how. */
export interface Overlay {
  grid: boolean;
  stretch: boolean;
  /** How much of the file's own drawing is visible, from 0 to 1. */
  own: number;
  /** How much of the map before is visible, from 0 to 1. */
  ghost: number;
  /** The share of the width left of which the file's own drawing is shown alone; null where it is not divided. */
  swipe: number | null;
  mapped: boolean;
  holes: boolean;
  mean: number;
  step: number;
  /** The texture alone, without shading or the file's own drawing. */
  plain?: boolean;
}

/** What the painter shows: the middle, pixels per unit, and the size in pixels. */
export interface PaintedView {
  x: number;
  y: number;
  zoom: number;
  width: number;
  height: number;
  /** Of a mesh: its rotation, row by row. */
  turn?: number[];
  /** Of a part of the canvas: where that begins. */
  left?: number;
  bottom?: number;
}

/** What the user does on the shapes and in the list. */
export interface Actions {
  select(item: Item): void;
  lock(item: Item): void;
  accept(...numbers: number[]): void;
  /** Select these pins alone. */
  selectOnly(numbers: number[]): void;
  place(side: Side, place: Place): Promise<void>;
  /** Place one end of a pin; the other one is placed on the other side. */
  placeEnd(side: Side, place: Place): void;
  stroke(side: Side, places: Place[], closed: boolean): Promise<void>;
  /** Returns whether it was moved. */
  drag(side: Side, item: Item, place: Place): boolean;
  turn(item: Item, degrees: number | null): void;
  /** Change what is said of a pin beside its places; `ended` unless it is still being dragged. */
  hold(item: Item, settings: PinSettings, ended?: boolean): void;
  /** Show what is said of a pin. */
  activate(item: Item): void;
  drop(): void;
  remove(item: Item, whole?: boolean): void;
  rename(item: Item, name: string): void;
  move(item: Item, typed: number[]): void;
  hover(item: Item | null): void;
}

/** What a pane shows of the editor. */
export interface PaneScene extends Scene {
  wrong: Wrong;
  suggested: Pin[];
  selected: Set<number>;
  locked: (entry: Pin | Stroke) => boolean;
  regions: Region[];
  /** Of each pin; null for exact ones, empty where that is not known. */
  patches: (Patch | null)[];
  /** The number of the pin whose settings are shown. */
  active: number | null;
  /** The end of a pin whose other end is placed next. */
  pending: PinEnd | null;
  /** Digits after the point of coordinates that are read, of the source and of the target. */
  digits: Record<Side, number>;
}

/** One end of a pin. */
export interface PinEnd {
  side: Side;
  place: Place;
}
