// Types of the data exchanged between page and server (see io/edit/messages.py and io/edit/page_view.py).

export type Side = 'source' | 'target';

/** The tool, which determines what clicks and drags on a shape do. */
export type Tool = 'pin' | 'pair' | 'stroke' | 'select';

/** Page coordinates: [x, y] with y down, or [x, y, z] on the surface of a mesh. */
export type Point = number[];

/** A place in the file: coordinates, or the name of a vertex of a mesh, such as `v5`. */
export type Place = number[] | string;

/** Left, top, right and bottom. */
export type Box = number[];

export interface Pin {
  name: string;
  weight: number;
  source: Place;
  target: Place;
  /** Rotation of the patch in degrees; null if free. */
  turn: number | null;
  /** Radius of the patch in the source's units; 0 for an exact pin; null or missing if automatic. */
  radius?: number | null;
  /** Largest distance from its place in the target's units; null or missing if automatic. */
  tolerance?: number | null;
  /** Scale of the patch relative to the mean scale of the map; null or missing if free. */
  scale?: number | null;
}

/** The settings of a pin. */
export type PinSettings = Partial<Pick<Pin, 'radius' | 'tolerance' | 'turn' | 'scale'>>;

/** The patch of a soft pin in the map, in file units. */
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
  /** Width of the band around the stroke that keeps its form, in the source's units; missing if there is none. */
  width?: number;
}

/** The edited state. A rigid region is a polygon, or the name of an element of the drawing. */
export interface Scene {
  pins: Pin[];
  strokes: Stroke[];
  rigid: (string | Place[])[];
  balance: number;
  turn: number | 'any';
  fit: string;
}

/** An entry of a scene, or one of the points of a stroke. */
export interface Item {
  kind: 'pins' | 'strokes' | 'rigid' | 'suggested';
  number: number;
  point?: number;
}

/** A rigid region of a map, with its outlines in page coordinates. */
export interface Region {
  dilatation: number;
  scale: number;
  source: Point[];
  target: Point[];
}

/** What pictures show of the target, and the tone that it paints below; empty if they show what it paints. */
export interface Silhouette {
  rings?: Point[][];
  toned?: Point[][];
  /** Of the paper and of the tone, or empty texts. */
  colors?: [string, string];
}

/** Indices of pins and strokes that the map does not meet. */
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
  /** The outlines that a whole drawing paints, in which case `outline` is the frame around it. */
  painted: Point[][] | null;
  box: Box;
  bounds: Box;
  canvas: Box;
  mesh: boolean;
  /** For a mesh: right, up and towards the viewer, row by row. */
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
  /** When it was last changed: an ISO 8601 date and time; empty if nothing is left. */
  left_when: string;
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

/** The figures of a map, as in the report. */
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
  /** 'blocked': the map that is seen has come to rest without reaching a pin. */
  kind: 'coarse' | 'full' | 'blocked' | 'error';
  seq: number;
  ok: boolean;
  message: string;
  figures: Figures;
  wrong: Wrong;
  outlines?: Point[][];
  silhouette?: Silhouette;
  /** For each pin; null for exact pins. */
  patches?: (Patch | null)[];
  other?: string;
  command?: string;
  /** Indices of the pins that stopped short of where they were dragged, and where all pins are now. */
  short?: number[];
  pins?: Pin[];
  /** Features of the picture that the map bends, the most bent first. */
  bent?: Bent[];
}

/** A feature of the picture: its middle on both sides, and its radius in the source, in file units. */
export interface Bent {
  source: [number, number];
  target: [number, number];
  radius: number;
}

/** Both ends of a pin. */
export type Ends = Pick<Pin, 'source' | 'target'>;

/** Sent when another tab takes over. */
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
  /** Whether the number of pixels can be chosen. */
  sized?: boolean;
  /** Files that the command reads and that have not been saved yet. */
  unsaved?: string[];
  /** Where files were written. */
  folder?: string;
  message?: string;
  notes?: string[];
  text?: string;
  name?: string;
}

/** The position of a texture in the plane, and how it continues beyond its edge. */
export interface Look {
  box: Box;
  edge: string;
  filter: string;
}

/** What is painted over the texture. */
export interface Overlay {
  grid: boolean;
  stretch: boolean;
  /** Opacity of the file's own drawing, from 0 to 1. */
  own: number;
  /** Opacity of the previous map, from 0 to 1. */
  ghost: number;
  /**
   * Position of the divider, as a share of the width; left of it only the file's own drawing is shown. null if not
   * divided.
   */
  swipe: number | null;
  mapped: boolean;
  holes: boolean;
  mean: number;
  step: number;
  /** The texture alone, without shading or the file's own drawing. */
  plain?: boolean;
}

/** The view of the renderer: its centre, pixels per unit, and the size in pixels. */
export interface PaintedView {
  x: number;
  y: number;
  zoom: number;
  width: number;
  height: number;
  /** For a mesh: its rotation, row by row. */
  turn?: number[];
  /** For a part of the canvas: its lower left corner. */
  left?: number;
  bottom?: number;
}

/** Actions of the user on the shapes and in the list. */
export interface Actions {
  select(item: Item): void;
  lock(item: Item): void;
  accept(...numbers: number[]): void;
  /** Select only these pins. */
  selectOnly(numbers: number[]): void;
  place(side: Side, place: Place): Promise<void>;
  /** Place one end of a pin; the other end is placed later on the other side. */
  placeEnd(side: Side, place: Place): void;
  stroke(side: Side, places: Place[], closed: boolean): Promise<void>;
  /** Returns whether the item was moved. */
  drag(side: Side, item: Item, place: Place): boolean;
  turn(item: Item, degrees: number | null): void;
  /** Change the settings of a pin; `ended` unless it is still being dragged. */
  hold(item: Item, settings: PinSettings, ended?: boolean): void;
  /** Keep the form of the area around a pin, or let it bend again; `radius` in file units. */
  keep(item: Item, radius: number): void;
  /** Show the settings of a pin. */
  activate(item: Item): void;
  drop(): void;
  remove(item: Item, whole?: boolean): void;
  rename(item: Item, name: string): void;
  move(item: Item, typed: number[]): void;
  hover(item: Item | null): void;
}

/** The state of the editor as a pane shows it. */
export interface PaneScene extends Scene {
  wrong: Wrong;
  suggested: Pin[];
  selected: Set<number>;
  locked: (entry: Pin | Stroke) => boolean;
  /** Returns where a pin that stopped short was dragged to. */
  wanted: (pin: Pin) => Ends | null;
  regions: Region[];
  /** Rigid regions as drawn, where the map does not have all of them. */
  unmapped: Place[][];
  /** Whether no map meets the pins, strokes and rigid regions. */
  failed: boolean;
  /** For each pin; null for exact pins, empty if not known. */
  patches: (Patch | null)[];
  /** Features of the picture that the map bends. */
  bent: Bent[];
  /** Index of the pin whose settings are shown. */
  active: number | null;
  /** The first end of a pin whose other end is still to be placed. */
  pending: PinEnd | null;
  /** Decimals of displayed coordinates, for source and target. */
  digits: Record<Side, number>;
}

/** One end of a pin. */
export interface PinEnd {
  side: Side;
  place: Place;
}
