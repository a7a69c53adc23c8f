// What the studio is asked and what it answers, from the types of the server by scripts/generate.

/** The studio, and who asks. */
export interface About {
  /** Whether one logs in. */
  asks_for_token: boolean;
  /** The name of the folder. */
  folder: string;
  is_demo: boolean;
  is_encrypted: boolean;
  /** Seconds since 1970. */
  now: number;
  /** `null` for who is not logged in. */
  session: OwnSession | null;
  version: string;
}

/** What does not change in an evolution. */
export interface AboutEvolution {
  /** The best fitness that there can be. */
  best: number | null;
  commands: EvolutionCommands;
  drawing: Drawing;
  /** Generations of each run. */
  generations: number;
  /** Whether there is a model to simulate plants with. */
  has_model: boolean;
  is_virtual: boolean;
  name: string;
  obstacles: Obstacle[];
  population: number;
  runs: number;
  seed: number;
  /** In cm. */
  targets: [number, number][];
  /** What the task is, in words. */
  task: string;
  /** Unit of the fitness. */
  unit: string;
}

/** What a rig has, and what is lit in it by hand. */
export interface AboutRig {
  has_flash: boolean;
  is_virtual: boolean;
  lamps: string[];
  /** Seconds for which something is lit, at most. */
  max_s: number;
  /** Columns and rows of a photograph, if the rig has a calibration. */
  size: [number, number] | null;
  state: RigState;
}

/** What does not change in a run. */
export interface AboutRun {
  /** Where the stem leaves the soil, in pixels. */
  base: [number, number] | null;
  /** The best fitness that there can be. */
  best: number | null;
  commands: RunCommands;
  /** In words. */
  controller: string;
  /** Column, row, columns and rows of what vision looks at. */
  crop: [number, number, number, number] | null;
  end_height: number | null;
  /** Rows of a photograph. */
  height: number | null;
  is_virtual: boolean;
  lamps: ShownLamp[];
  /** The line that the stem is to follow. */
  line: ShownPoint[];
  max_steps: number;
  name: string;
  obstacles: Obstacle[];
  period_min: number;
  px_per_cm: number | null;
  seed: number;
  targets: ShownPoint[];
  /** Unit of the fitness. */
  unit: string;
  /** Columns of a photograph. */
  width: number | null;
  /** Difference from a form at which it is reached, in cm. */
  within: number | null;
}

/** Work that began, or waits in the queue. */
export interface BegunWork {
  /** The place of what it makes. */
  at: string;
  command: string;
  /** Number of its job; `null` for a run and a rig file, which wait in no queue. */
  job: number | null;
}

/** A calibration by clicks. */
export interface Calibrated {
  /** The commands that do the same. */
  commands: [string, string];
  /** Whether the rig file has it now. */
  is_written: boolean;
  px_per_cm: number;
  /** `[calibration]` of a rig file. */
  table: string;
}

/** A comparison as the page shows it. */
export interface Compared {
  /** The command that does the same. */
  command: string;
  comparisons: ReportComparison[];
  figures: ComparedFigure[];
  /** Names of all files of figures. */
  files: string[];
  /** Figures for which there are no data. */
  left_out: LeftOut[];
}

/** A figure of a comparison. */
export interface ComparedFigure {
  /** The name of its files, without their endings. */
  name: string;
  title: string;
}

/** Where the tip was when it first reached a target's height. */
export interface Crossing {
  /** Distance between tip and target, in cm. */
  distance_cm: number;
  /** Step of the observation. */
  step: number;
}

/** Where deleted work is kept. */
export interface Deleted {
  kept: string;
}

/** What one device answered. */
export interface DeviceResult {
  /** `flash`, `lamps`, or a lamp by its name, such as `left lamp`. */
  device: string;
  /** Whether it confirmed that it is off. */
  is_off: boolean;
  /** Why it is not known to be off. */
  problem: string | null;
}

/** The answer to what has nothing to tell. */
export type Done = {};

/** What was drawn: targets with what stands in the way, or a form of the stem. */
export interface Drawing {
  /** The form that the stem is to have, in place of all else. */
  form?: Form | null;
  /** What the stem must not touch. */
  obstacles: Obstacle[];
  /** In cm. */
  targets: [number, number][];
  /** Points to steer by on the way, in cm. */
  way_points: [number, number][];
}

/** The task file of a drawing, and the best fitness that there can be. */
export interface DrawnTask {
  best: number | null;
  task: string;
}

/** Whether work has ended that was asked to. */
export interface Ended {
  /** `false` if it goes on until its step is over. */
  has_ended: boolean;
  was_running: boolean;
}

/** What a person types to do with an evolution what the page does. */
export interface EvolutionCommands {
  extend: string;
  resume: string;
  run: string;
  status: string;
  stop: string;
}

/** What a page that watches an evolution is sent. */
export interface EvolutionNews {
  /** Best fitness of each run at the marks that it has reached. */
  best: number[][];
  /** Generations that are done, of all runs. */
  done: number;
  /** Evaluations of all runs. */
  evaluations: number;
  /** Generations of each run. */
  generations: number;
  /** Best fitness of each run so far; `null` before its first generation. */
  latest: (number | null)[];
  /** Seconds until it is over. */
  left_s: number | null;
  /** Mean number of links, at each mark. */
  links: number[];
  /** The generations that are shown, from 1. */
  marks: number[];
  /** Its median. */
  median: number[];
  /** Seconds since 1970. */
  now: number;
  /** Number of the process that works on it. */
  process: number | null;
  /** Lower quartile of the best fitness over the runs, at each mark. */
  q1: number[];
  /** Its upper quartile. */
  q3: number[];
  /** Evaluations a second. */
  rate: number | null;
  /** Once it is over. */
  results: ShownResults | null;
  /** Mean number of species, at each mark. */
  species: number[];
  state: WorkState;
  /** Its highest value. */
  top: number[];
  /** Generations of all runs. */
  total: number;
}

/** An evolution or a search that waits in the queue. */
export interface Evolving {
  /** Where it will lie. */
  at: string;
  /** The commands that do the same. */
  commands: string[];
  /** Number of its job. */
  job: number;
  /** Text of its task file. */
  task: string;
}

/** How a field is filled in. */
export type FieldKind = "choice" | "number" | "flag" | "name" | "place";

/** A form of the stem: the line that it is to follow, or what is wanted of its bow. In cm. */
export interface Form {
  /** Where the bow is farthest to the side. */
  apex: [number, number] | null;
  /** Height of the tip at which the form counts; that of the highest point of the line by default. */
  end_height_cm: number | null;
  /** Where the bow changes its side. */
  inflection: [number, number] | null;
  /** Lean of the upper third to the vertical in degrees, below 0 to the left. */
  lean_deg: number | null;
  /** From the root upwards; empty for none. */
  line: [number, number][];
  /** Radius of the bow in cm, below 0 to the left. */
  radius_cm: number | null;
  /** Difference from the form at which it is reached, in cm. */
  within_cm: number | null;
}

/** The forms of the page. */
export interface Forms {
  forms: ShownForm[];
}

/** A step of the bean: its tip, the lamp that is lit from here on, and its stem. */
export interface Frame {
  /** `left` or `right`; `null` at the end. */
  lamp: string | null;
  /** How far the stem is from the wanted form, in cm; of tasks with a form. */
  off?: number | null;
  /** Points of the stem from the root on, in cm. */
  stem: [number, number][];
  /** Whether it touches an obstacle. */
  touches: boolean;
  /** The tip, in cm to the right of the root. */
  x: number;
  /** The tip, in cm above the soil. */
  y: number;
}

/** Status of one photograph: `Ok`, or why its tip is not used. */
export type FrameStatus = "ok" | "corrupt" | "foreign" | "dark" | "no_plant" | "repeated" | "ambiguous" | "hidden" | "leaves_view" | "jump" | "disputed" | "clock_gap";

/** That a run is not here any more. */
export type Gone = "gone";

/** A plant that grew before a wall, to its end. */
export interface GrownBeforeWall {
  /** Pictures, a quarter of an hour apart at five minutes a step. */
  pictures: WallPicture[];
  /** Whether the tip passed each level on the side of the path, lowest first; fewer if it did not get there. */
  right: boolean[];
}

/** A piece of work as a row of the overview. */
export interface Item {
  /** Its place below the folder. */
  at: string;
  /** Seconds since 1970. */
  began: number | null;
  /** When it last wrote something, in seconds since 1970. */
  changed: number | null;
  done: number | null;
  /** `good`, or what to look at first. */
  health: string;
  is_virtual: boolean | null;
  kind: Kind | null;
  lamp: string | null;
  name: string;
  /** When the next one is due, in seconds since 1970. */
  next: number | null;
  /** When the latest photograph was written, in seconds since 1970. */
  photo: number | null;
  photo_name: string | null;
  /** Begin of the digest of the photograph of a run that goes on. */
  photo_v: string | null;
  state: WorkState;
  step: number | null;
  tags: string[];
  /** Best or last, in words. */
  text: string;
  /** Tip of a run, in cm. */
  tip: [number, number] | null;
  total: number | null;
  /** A fitness, in cm, to sort by. */
  value: number | null;
}

/** What changed in the overview. */
export interface ItemsNews {
  /** Whether this is all work. */
  all: boolean;
  /** Places of work that is gone since; none beside all work. */
  gone: string[];
  items: Item[];
  /** Seconds since 1970. */
  now: number;
  /** The queue, if it changed. */
  queue: ShownJob[] | null;
}

/** What a job has said. */
export interface JobLog {
  log: string;
}

/** What became of a job. */
export type JobState = "waiting" | "running" | "done" | "failed" | "stopped";

/** A kind of work. */
export type Kind = "run" | "evolution" | "study" | "sweep" | "transfer" | "replicates" | "walls" | "rule";

/** An event of a run. */
export interface LatestEvent {
  /** Kind of event. */
  kind: string;
  /** The latest step then. */
  step: number;
  /** What was found and what was done about it. */
  text: string;
  /** Seconds since 1970; of real plants. */
  unix_s: number | null;
}

/** A figure that a report does not have, and why. */
export interface LeftOut {
  /** Its number. */
  figure: string;
  /** Why it is left out, and what it needs. */
  reason: string;
}

/** The light of 24 hours. */
export interface LightOfDay {
  /** Hours with a lamp lit. */
  hours: number;
  /** Photons at the plant, in mol/m²; `null` where the rig does not say what its lamps give. */
  mol: number | null;
}

/** Detection method. */
export type Mode = "paper" | "robust";

/** Files of models in the folder. */
export interface Models {
  models: string[];
}

/** A node at one time. */
export interface NodeState {
  /** Whether the plant has reached it, or is taken to have. */
  done: boolean;
  /** Level of its lamp, 0 to 255. */
  level: number;
  /** Whether it sees the plant. */
  sees: boolean;
}

/** One obstacle. */
export interface Obstacle {
  /** Ends of the axis of a round bar in space, in cm: x to the right, y up, z towards the camera. */
  bar?: [[number, number, number], [number, number, number]] | null;
  /** Two opposite corners of a box with sides along x and y, in cm. */
  box?: [Point, Point] | null;
  /** Centre of a disc, such as a rod seen from its end, in cm. */
  disc?: Point | null;
  /** Height of the pole, in cm; without it the pole leaves the tent. */
  height_cm?: number | null;
  /** Ends of a thin straight bar, in cm. */
  line?: [Point, Point] | null;
  /** Axis of an upright pole, in cm: x to the right, z towards the camera. */
  pole?: [number, number] | null;
  /** Radius of the disc, the pole or the bar, in cm above 0. */
  radius_cm?: number | null;
}

/** How far a stem is from the form that it is to have, in cm. */
export interface Off {
  end: OffAtEnd | null;
  /** When it was last seen. */
  now: number | null;
}

/** How far a stem was from the form at the step at which it counts. */
export interface OffAtEnd {
  hours: number;
  /** In cm. */
  off: number | null;
  step: number;
}

/** The session of who asks. */
export interface OwnSession {
  /** The word that changes carry. */
  csrf: string;
  /** Whether nothing may be changed. */
  read_only: boolean;
}

/** How far a part of a long work is. */
export interface PartStatus {
  /** The best fitness so far, where something is searched for. */
  best: number | null;
  /** Unit of the fitness: `cm`, or `turns` round a pole. */
  best_unit: string | null;
  /** How much is done. */
  done: number;
  /** Its name. */
  name: string;
  /** Wall-clock seconds that were spent on it, where they are kept. */
  seconds: number | null;
  /** How much there is to do. */
  total: number;
  /** What is counted, in the plural: `generations`. */
  unit: string;
}

/** A photograph that was taken by hand. */
export interface PhotoByHand {
  /** By which it is asked for. */
  number: number;
  /** What is seen in it; `null` as long as the rig file has no calibration. */
  seen: Seen | null;
}

/** A place in a photograph, in pixels: x to the right, y down. Whole numbers are the centres of pixels. */
export interface Pixel {
  /** Pixels to the right of the centre of the leftmost column. */
  x: number;
  /** Pixels below the centre of the topmost row. */
  y: number;
}

/** A point in the plane of the stem, in cm: x to the right of the root as the camera sees it, y up from the soil. */
export type Point = [number, number];

/** What is expected of a form; ranges hold eight of ten plants that reach the height at which it counts. */
export interface PredictedForm {
  /** Plants that reach the form. */
  done: number;
  /** Hours until the height. */
  hours: [number, number] | null;
  /** Difference from the form then, in cm. */
  off: [number, number] | null;
  /** Plants that reach the height. */
  reached: number;
}

/** What is expected at a target; ranges hold eight of ten plants that reach its height. */
export interface PredictedTarget {
  /** Distance from the target then, in cm. */
  beside: [number, number] | null;
  /** Hours until then. */
  hours: [number, number] | null;
  /** Share of all simulated plants that pass it within 1 cm. */
  probability: number;
  /** Plants that reach its height. */
  reached: number;
  x: number;
  y: number;
}

/** What is expected of a run. */
export interface Prediction {
  /** Of a task with a form of the stem. */
  form: PredictedForm | null;
  /** The tip from which on it is, in cm. */
  from: [number, number];
  /** Whether the plants go through obstacles. */
  goes_through: boolean;
  /** File of the model, below the folder of the studio. */
  model: string;
  /** Paths of some of the plants, in cm. */
  paths: [number, number][][];
  /** Simulated plants. */
  plants: number;
  /** Targets above the tip. */
  targets: PredictedTarget[];
}

/** The command of a form as a person types it, and the place of what it makes. */
export interface Preview {
  at: string;
  command: string;
}

/** What acted of a programme at the latest step. */
export interface ProgrammeStatus {
  /** The base light, with the names of the rig. */
  base: string;
  /** Whether what is decided is lit. */
  is_steered: boolean;
  /** Number of the part, from 1; 0 outside of all. */
  part: number;
  /** Its times, such as `06:00 to 22:00`; `night` outside of all parts. */
  times: string;
}

/** Work that waits in the queue. */
export interface Queued {
  /** Number of its job. */
  job: number;
}

/** Where renamed work lies. */
export interface Renamed {
  at: string;
}

/** Things of one kind, compared pair by pair. */
export interface ReportComparison {
  /** Each two of them; none where their tasks differ. */
  pairs: SamplePair[];
  /** What is compared. */
  title: string;
  /** Unit of the values: `cm`, `turns`, or both where tasks differ. */
  unit: string;
}

/** What is lit in a rig by hand. */
export interface RigState {
  /** Seconds until it goes off. */
  left_s: number | null;
  /** A lamp, or `flash`. */
  lit: string | null;
  /** The photograph that was asked for. */
  photo?: PhotoByHand | null;
  /** A lamp that did not obey. */
  problem: string | null;
}

/** Rig files in the folder, and the word for the virtual tent. */
export interface Rigs {
  rigs: string[];
  tent: string;
}

/** A step of a run, as short as it can be: a run has thousands. */
export type Row = [step: number, hours: number, x: number | null, y: number | null, stem: number | null, lamp: string | null, is_confirmed: number, is_carried_forward: number, status: string, confidence: number, unix: number | null, photo: string, column: number | null, row: number | null, digest: string, is_steered: number | null];

/** What a person types to do with a run what the page does. */
export interface RunCommands {
  resume: string;
  safe_state: string;
  status: string;
  stop: string;
}

/** What a page that watches a run is sent. */
export interface RunNews {
  events: ShownEvent[];
  /** Number of the first of these events. */
  events_from: number;
  /** Number of the first of these rows. */
  from: number;
  /** Seconds since 1970. */
  now: number;
  rows: Row[];
  status: RunNow;
}

/** How a run is, or that its folder was deleted or renamed. */
export type RunNow = ShownStatus | { state: Gone };

/** Whether a run goes on. */
export type RunState = "running" | "overdue" | "stopped" | "died" | "paused" | "over";

/** What a run does now. */
export interface RunStatus {
  /** Photographs without a detected plant. */
  carried_forward: number;
  /** Those in a row up to the latest one. */
  carried_forward_now: number;
  /** The controller in a few words. */
  controller: string;
  /** Free bytes on the disk. */
  disk_free_bytes: number | null;
  /** Days until the disk is full. */
  disk_lasts_days: number | null;
  /** How many events of each kind there are; kinds without events are left out. */
  event_counts: Record<string, number>;
  /** Whether the plant is virtual. */
  is_virtual: boolean;
  /** The lighting that the lamps were commanded last, with their names in the rig. */
  lamp: string | null;
  /** The latest events that people are alerted to by default, in order. */
  latest_events: LatestEvent[];
  /** Light of the 24 hours up to the latest step; of real plants. */
  light?: LightOfDay | null;
  /** The most steps of its task. */
  max_steps: number;
  /** Seconds until the next step is due, below 0 if it is late; of real plants while the run goes on. */
  next_step_in_s: number | null;
  /** How probably the plant of a run passes each target; empty without a model. */
  outlook?: TargetOutlook[];
  /** File of the latest photograph. */
  photograph: string | null;
  /** Its age in seconds. */
  photograph_age_s: number | null;
  /** Size of all photographs. */
  photographs_bytes: number;
  /** Number of the process that works on it. */
  process: number | null;
  /** What acts of the programme of its rig; left out without one. */
  programme?: ProgrammeStatus | null;
  /** Run folder. */
  run: string;
  /** Whether it goes on. */
  state: RunState;
  /** The latest step, from 0. */
  step: number | null;
  /** The lamps that may still be lit though no program works on the run; of real plants. */
  still_lit: string | null;
  /** The latest tip, in cm to the right of the root. */
  tip_x_cm: number | null;
  /** The latest tip, in cm above the soil. */
  tip_y_cm: number | null;
  /** Decisions that no lamp confirmed. */
  unconfirmed: number;
}

/** What was switched off. */
export interface SafeStateResults {
  /** Each device that was printed. */
  devices: DeviceResult[];
  /** Whether the lamps were left as they are. */
  is_kept: boolean;
  /** Whether the tent is virtual: then nothing is lit. */
  is_virtual: boolean;
  /** Rig file or run folder. */
  rig: string;
}

/** Two samples compared by a Mann-Whitney U test. */
export interface SamplePair {
  /** Whether `p` is exact, and no normal approximation. */
  is_exact: boolean;
  /** Median of the first minus that of the second. */
  median_difference: number;
  /** Name of the first sample. */
  one: string;
  /** Name of the second. */
  other: string;
  /** Two-sided p-value. */
  p: number;
  /** `p` after Holm's correction over all pairs of this comparison. */
  p_holm: number;
  /** Number of values of each. */
  sizes: [number, number];
  /** Vargha and Delaney's A: the probability that a value of the first is greater than one of the second, ties as half. */
  superiority: number;
  /** U of the first sample. */
  u: number;
}

/** A task file that was written. */
export interface SavedTask {
  /** Commands that use it. */
  commands: string[];
  file: string;
  /** Its text. */
  task: string;
}

/** A wall file that was written. */
export interface SavedWall {
  /** Commands that use it. */
  commands: string[];
  file: string;
}

/** What is seen in a photograph by itself, without those before it. */
export interface Seen {
  /** 0 to 1. */
  confidence: number;
  /** Name of the `FrameStatus`: `ok`, or why no plant is seen. */
  status: string;
  /** Tip in cm, if it was found. */
  tip: Point | null;
  /** Tip in pixels, if it was found. */
  tip_px: Pixel | null;
}

/** What settings see in a photograph. */
export interface SeenPhoto {
  /** The tip, in cm. */
  cm: [number, number] | null;
  /** 0 to 1. */
  confidence: number;
  /** Its name. */
  photo: string;
  state: SeenState;
  status: FrameStatus;
  /** Points of the stem, in pixels. */
  stem: [number, number][] | null;
  /** The tip, in pixels. */
  tip: [number, number] | null;
}

/** Whether a plant is seen in a photograph. */
export type SeenState = "missed" | "uncertain" | "found";

/** A champion as a page shows it. */
export interface ShownChampion {
  /** What it decides where the tip may be. */
  decision: ShownFigure | null;
  /** Number of hidden neurons. */
  hidden: number;
  /** A sentence that says what these plants are. */
  label: string;
  /** Number of links. */
  links: number;
  /** Its network. */
  network: ShownFigure | null;
  /** Its paths on simulated plants. */
  paths: ShownPath[];
  /** Why its network is not drawn; `null` if it is. */
  too_large: string | null;
}

/** Where the tip first reached the height of a target. */
export interface ShownCrossing {
  /** Distance from the target, in cm. */
  beside: number;
  hours: number;
  step: number;
}

/** An event of a run. */
export interface ShownEvent {
  is_warning: boolean;
  kind: string;
  /** What it means. */
  says: string;
  /** The latest step then. */
  step: number;
  /** What was found and what was done about it. */
  text: string;
  /** What a person should do. */
  todo: string | null;
  /** Seconds since 1970; of real plants. */
  unix: number | null;
}

/** A field of a form. */
export interface ShownField {
  is_needed: boolean;
  kind: FieldKind;
  label: string;
  name: string;
  /** Values to choose from. */
  offered: string[];
  preset: string;
}

/** A figure that is one drawing. */
export interface ShownFigure {
  /** Caption. */
  caption: string;
  /** The paper's number, such as `4a`. */
  number: string;
  /** The drawing. */
  svg: string;
  /** Title. */
  title: string;
}

/** A form of the page. */
export interface ShownForm {
  fields: ShownField[];
  /** Also the command. */
  name: string;
  says: string;
  title: string;
}

/** A job as pages show it. */
export interface ShownJob {
  at: string;
  /** As a person types them. */
  commands: string[];
  number: number;
  /** Why it failed. */
  problem: string;
  state: JobState;
}

/** A lamp of a run. */
export interface ShownLamp {
  name: string;
  /** -1 on the left, 1 on the right, else 0. */
  side: number;
}

/** A node and its place. */
export interface ShownNode {
  /** Its place, in cm to the right of the root and above the soil. */
  at: [number, number];
  /** Its name. */
  name: string;
}

/** The path of a simulated plant. */
export interface ShownPath {
  /** Fitness, in the unit of the task. */
  fitness: number;
  /** The lamp at each of them. */
  lamps: (string | null)[];
  /** Tips, in cm. */
  points: [number, number][];
}

/** A point in cm, and in the photograph. */
export interface ShownPoint {
  px: [number, number] | null;
  x: number;
  y: number;
}

/** The runs of an evolution that is over. */
export interface ShownResults {
  /** The run whose champion is to be used on plants. */
  champion: number;
  runs: ShownRun[];
  seconds: number;
}

/** A run of an evolution, as its champion was judged; fitness in the unit of the task. */
export interface ShownRun {
  /** Fitness when it was evaluated. */
  best: number;
  /** Expected fitness on an unseen plant. */
  expected: number | null;
  /** Number of links. */
  links: number;
  /** Mean fitness on unseen plants of the model. */
  mean: number;
  run: number;
  /** Standard deviation of it. */
  sd: number | null;
  /** Why nothing is expected. */
  withheld: string | null;
}

/** How a run is. */
export interface ShownStatus {
  /** Size of all photographs. */
  bytes: number;
  /** Photographs without a detected plant. */
  carried_forward: number;
  /** Those in a row up to the latest one. */
  carried_forward_now: number;
  /** How many events of each kind there are. */
  counts: Record<string, number>;
  /** For each target, where the tip first reached its height. */
  crossings: (ShownCrossing | null)[];
  /** Days until the disk is full. */
  disk_days: number | null;
  disk_gb: number | null;
  /** Of a run that is over. */
  fitness: number | null;
  /** `good`, or what to look at first. */
  health: string;
  /** Distinguishes it from another run that lies or lay in the same folder. */
  identity: string | null;
  /** When the next one is due, in seconds since 1970. */
  next_unix: number | null;
  /** Of a task with a form of the stem. */
  off: Off | null;
  period_s: number | null;
  /** When the latest photograph was written, in seconds since 1970. */
  photo_unix: number | null;
  /** Number of the process that works on it. */
  process: number | null;
  /** What acts of the programme of its rig. */
  programme: string | null;
  state: WorkState;
  /** The lamps that may still be lit though no program works on it. */
  still_lit: string | null;
  /** Decisions that no lamp confirmed. */
  unconfirmed: number;
}

/** A wall as it is drawn. */
export interface ShownWall {
  /** Pairs of their numbers: from a node to one that may follow it on a path. */
  links: [number, number][];
  /** Its nodes. */
  nodes: ShownNode[];
  /** Numbers of the nodes on its path, lowest first; a random path is that of the first plant. */
  path: number[];
}

/** Any work. */
export interface ShownWork {
  /** What a person types to look at it, and to go on with it. */
  commands: string[];
  /** The task of a rule that is not searched for. */
  drawing: Drawing | null;
  is_at_work: boolean;
  kind: Kind;
  name: string;
  /** As `tropism status --json` prints it. */
  status: StatusResults;
}

/** What the work in a folder does now. */
export type StatusResults = RunStatus | WorkStatus;

/** The stem in a photograph. */
export interface StemSeen {
  /** Its points, in pixels; `null` if it was not seen. */
  stem: [number, number][] | null;
}

/** The tags of a piece of work. */
export interface Tags {
  tags: string[];
}

/** What is known of one target. */
export interface TargetOutlook {
  /** Median distance at which simulated plants pass it, in cm; `null` where fewer than half of them get so high. */
  expected_cm: number | null;
  /** 95 % interval of the probability, from how much the measured plants of the model differ; `null` where it is not known. */
  interval?: [number, number] | null;
  /** Distance between tip and target when the tip reached its height, in cm; `null` while it is lower. */
  passed_cm: number | null;
  /** Probability that the tip passes within 1 cm of the target, 0 to 1; 0 or 1 once it has passed. */
  probability: number;
  /** The target, in cm. */
  target: Point;
}

/** What virtual common beans reach, as the page shows it. */
export interface ToldReach {
  is_virtual: boolean;
  /** The steepest lean to the vertical of the upper third of such a stem, in degrees. */
  lean_deg: number;
  /** The farthest place at which a stem is whose tip has just become higher than ever. */
  stems: [number, number][];
  /** The farthest place at which a tip arrives at a height for the first time. */
  tips: [number, number][];
}

/** A bean that was tried, from one of its steps on. */
export interface TriedBean {
  /** For each target, where the tip first reached its height. */
  crossings: (Crossing | null)[];
  /** Fitness so far at each of them, in cm. */
  fitness: number[];
  /** Its steps. */
  frames: Frame[];
  /** The step from which on it is sent. */
  from: number;
  /** Whether the task is over. */
  is_over: boolean;
}

/** Photographs, the settings of vision that they have, and what these see in some of them. */
export interface TuneBegin {
  /** Rows of a photograph. */
  height: number;
  is_virtual: boolean;
  /** How many photographs there are. */
  photographs: number;
  seen: SeenPhoto[];
  settings: TuneSettings;
  /** Columns of a photograph. */
  width: number;
}

/** The file that settings were written into. */
export interface TuneFile {
  file: string;
  text: TuneText;
}

/** What other settings see in the same photographs. */
export interface TuneLook {
  seen: SeenPhoto[];
  text: TuneText;
}

/** The settings that the page changes. */
export interface TuneSettings {
  /** Pixel at which the stem leaves the soil. */
  base: [number, number];
  contrast: number;
  mode: Mode;
  px_per_cm: number;
  /** Column, row, columns and rows; the whole picture if it is left out. */
  roi: [number, number, number, number] | null;
  threshold: number;
}

/** Settings as the text of a file, and the command that tracks with them. */
export interface TuneText {
  command: string;
  toml: string;
}

/** Wall and plant at one time. */
export interface WallPicture {
  /** Each node; `null` of one that said nothing. */
  nodes: (NodeState | null)[];
  /** Points of the stem from the root on, in cm; none where nobody saw it. */
  stem: [number, number][];
  /** When, in words: `12.5 h`, or `step 481`. */
  when: string;
}

/** Wall files, and folders in which a wall is watched. */
export interface Walls {
  files: string[];
  watched: string[];
}

/** What the nodes of a real wall said last. */
export interface WatchedWall {
  /** The command that watches it. */
  command: string;
  /** A picture a step. */
  pictures: WallPicture[];
  wall: ShownWall;
}

/** How a piece of work is. */
export type WorkState = "over" | "live" | "overdue" | "stopped" | "died" | "paused" | "broken";

/** What a long work does now. */
export interface WorkStatus {
  /** Its folder, or the file of a rule. */
  folder: string;
  /** Whether its results are written. */
  is_over: boolean;
  /** Whether programs work on units of it. */
  is_shared: boolean;
  /** Whether its plants are virtual, or it works on a model of such; `null` where that is not known. */
  is_virtual: boolean | null;
  /** How far each of its parts is, in order: stages, runs, settings, controllers, scenarios. */
  parts: PartStatus[];
  /** Number of the process that works on all of it. */
  process: number | null;
  /** Seconds since something was saved last, where it is not over. */
  saved_ago_s: number | null;
  /** Its workflow: `study`. */
  work: string;
}

/** A note that was written, or that the run writes at its next step. */
export interface Written {
  is_waiting: boolean;
  step: number | null;
}

/** What lies at a place below the folder. */
export interface At {
  at?: string;
}

/** What was clicked in a photograph that was taken by hand. */
export interface Clicked {
  /** Where the stem leaves the soil, in pixels. */
  base: [number, number];
  /** Both ends of something in the plane of the stem, in pixels. */
  ends: [[number, number], [number, number]];
  /** The length between them, in cm. */
  length_cm: number;
  /** Number of the photograph. */
  number: number;
  /** The rig whose camera took it. */
  rig: string;
  /** Whether the rig file takes it. */
  write?: boolean;
}

/** What was drawn: targets with what stands in the way, or a form of the stem. */
export interface AskedDrawing {
  /** The form that the stem is to have, in place of all else. */
  form?: AskedForm | null;
  /** What the stem must not touch. */
  obstacles?: Obstacle[];
  /** In cm. */
  targets?: [number, number][];
  /** Points to steer by on the way, in cm. */
  way_points?: [number, number][];
}

/** A drawing in an address. */
export interface Drawn {
  /** JSON of a `Drawing`. */
  drawing: string;
}

/** A wall with the path that a page drew. */
export interface DrawnWall {
  /** Wall file; empty for the wall of three levels. */
  file?: string;
  /** Names of the nodes on the path, lowest first, with commas between them; the path of the file if it is empty. */
  path?: string;
}

/** An evolution, or a search for a rule, that a page asks for. */
export interface EvolveRequest {
  drawing: AskedDrawing;
  generations?: number;
  method?: Method;
  /** File of the model; that of virtual beans if it is left out. */
  model?: string | null;
  name: string;
  runs?: number;
  seed?: number;
}

/** An evolution and the generations that it is to have. */
export interface Extend {
  at?: string;
  generations: number;
}

/** A form that was filled in. */
export interface Filled {
  form: string;
  /** Values by the names of fields; what is left out or empty is not given. */
  values: Record<string, string>;
}

/** A form in an address. */
export interface FilledIn {
  /** JSON of a `begin::Filled`. */
  form: string;
}

/** A form of the stem: the line that it is to follow, or what is wanted of its bow. In cm. */
export interface AskedForm {
  /** Where the bow is farthest to the side. */
  apex?: [number, number] | null;
  /** Height of the tip at which the form counts; that of the highest point of the line by default. */
  end_height_cm?: number | null;
  /** Where the bow changes its side. */
  inflection?: [number, number] | null;
  /** Lean of the upper third to the vertical in degrees, below 0 to the left. */
  lean_deg?: number | null;
  /** From the root upwards; empty for none. */
  line?: [number, number][];
  /** Radius of the bow in cm, below 0 to the left. */
  radius_cm?: number | null;
  /** Difference from the form at which it is reached, in cm. */
  within_cm?: number | null;
}

/** A number of a job, or of a photograph. */
export interface JobNumber {
  number: number;
}

/** What one logs in with. */
export interface LogIn {
  token: string;
}

/** Settings of vision in an address. */
export interface LookAt {
  /** JSON of a `tune::TuneRequest`. */
  plan: string;
}

/** Several pieces of work. */
export interface ManyAt {
  /** Places below the folder, each in a line of its own. */
  at: string;
  name?: string;
}

/** What a controller is made by. */
export type Method = "evolve" | "tune";

/** Work, and a name: its new one, or its own once more. */
export interface Named {
  at: string;
  name: string;
}

/** A note about a run. */
export interface Noted {
  at: string;
  step?: number | null;
  text: string;
}

/** A run of an evolution; the champion of all by default. */
export interface RunAt {
  at?: string;
  run?: number | null;
}

/** A drawing that is to be a task file. */
export interface Save {
  drawing: AskedDrawing;
  name: string;
  /** Whether it takes the place of another task of this name. */
  replace?: boolean;
}

/** A wall to be saved. */
export interface SaveWall {
  file?: string;
  name: string;
  path: string;
}

/** A step of a run. */
export interface StepAt {
  at?: string;
  step: number;
}

/** Work, and the tags that it is to have. */
export interface Tagged {
  at: string;
  tags: string[];
}

/** A bean to try a controller on. */
export interface TryPlan {
  /** The evolution whose champion steers, or the tuned rule that does. */
  at?: string;
  /** JSON of the `Drawing`. */
  drawing: string;
  /** The first step that is sent. */
  from?: number;
  /** With `Who::You`, a letter `l` or `r` for each step so far. */
  lights?: string;
  /** The run of the evolution; the champion of all by default. */
  run?: number | null;
  /** Seed of the bean. */
  seed: number;
  who: Who;
}

/** A plant to be led. */
export interface TryWall {
  /** Wall file; empty for the wall of three levels. */
  file?: string;
  /** Names of the nodes on the path, lowest first, with commas between them. */
  path: string;
  rule: WallRule;
  /** Seed of the plant. */
  seed: number;
}

/** What a page asks for. */
export interface TuneRequest {
  at: string;
  /** Name of the file that is written, without its ending. */
  name?: string;
  /** Names of the photographs to look at; taken evenly from all by default. */
  photographs?: string[];
  settings: AskedTuneSettings;
}

/** The settings that the page changes. */
export interface AskedTuneSettings {
  /** Pixel at which the stem leaves the soil. */
  base: [number, number];
  contrast: number;
  mode: Mode;
  px_per_cm: number;
  /** Column, row, columns and rows; the whole picture if it is left out. */
  roi?: [number, number, number, number] | null;
  threshold: number;
}

/** What runs in each node. */
export type WallRule = "machine" | "path-lit" | "dormant";

/** Who steers a bean that is tried. */
export type Who = "champion" | "greedy" | "you";

/** What a page wants of a rig. */
export type Wish = { do: "light"; lamp: string; rig: string; seconds: number } | { do: "dark"; rig: string } | { do: "photo"; has_flash: boolean; rig: string };

/** What can be asked for: what the address says, and the answer. */
export interface Gets {
  "api/begin/command": { asked: FilledIn; answer: Preview };
  "api/compare": { asked: ManyAt; answer: Compared };
  "api/evolution": { asked: At; answer: AboutEvolution };
  "api/evolution/champion": { asked: RunAt; answer: ShownChampion };
  "api/forms": { asked: {}; answer: Forms };
  "api/items": { asked: {}; answer: ItemsNews };
  "api/models": { asked: {}; answer: Models };
  "api/queue/log": { asked: JobNumber; answer: JobLog };
  "api/reach": { asked: {}; answer: ToldReach };
  "api/rig": { asked: At; answer: AboutRig };
  "api/rigs": { asked: {}; answer: Rigs };
  "api/run": { asked: At; answer: AboutRun };
  "api/run/prediction": { asked: At; answer: Prediction };
  "api/run/stem": { asked: StepAt; answer: StemSeen };
  "api/session": { asked: {}; answer: About };
  "api/tags": { asked: At; answer: Tags };
  "api/task": { asked: Drawn; answer: DrawnTask };
  "api/try": { asked: TryPlan; answer: TriedBean };
  "api/tune": { asked: At; answer: TuneBegin };
  "api/tune/look": { asked: LookAt; answer: TuneLook };
  "api/wall": { asked: DrawnWall; answer: ShownWall };
  "api/wall/try": { asked: TryWall; answer: GrownBeforeWall };
  "api/wall/watched": { asked: At; answer: WatchedWall };
  "api/walls": { asked: {}; answer: Walls };
  "api/work": { asked: At; answer: ShownWork };
}

/** Changes: the body, and the answer. */
export interface Posts {
  "api/begin": { asked: Filled; answer: BegunWork };
  "api/delete": { asked: Named; answer: Deleted };
  "api/draw/evolve": { asked: EvolveRequest; answer: Evolving };
  "api/draw/save": { asked: Save; answer: SavedTask };
  "api/evolution/extend": { asked: Extend; answer: Queued };
  "api/evolution/pause": { asked: At; answer: Ended };
  "api/evolution/resume": { asked: At; answer: Queued };
  "api/login": { asked: LogIn; answer: Done };
  "api/logout": { asked: {}; answer: Done };
  "api/queue/cancel": { asked: JobNumber; answer: Done };
  "api/queue/remove": { asked: JobNumber; answer: Done };
  "api/rename": { asked: Named; answer: Renamed };
  "api/rig": { asked: Wish; answer: RigState };
  "api/rig/calibrate": { asked: Clicked; answer: Calibrated };
  "api/run/note": { asked: Noted; answer: Written };
  "api/run/resume": { asked: At; answer: Done };
  "api/run/safe-state": { asked: At; answer: SafeStateResults };
  "api/run/stop": { asked: At; answer: Ended };
  "api/tags": { asked: Tagged; answer: Tags };
  "api/tune/write": { asked: TuneRequest; answer: TuneFile };
  "api/wall/save": { asked: SaveWall; answer: SavedWall };
}

/** What pages listen to, and what they are sent. */
export interface Topics {
  "evolution": EvolutionNews;
  "items": ItemsNews;
  "run": RunNews;
}
