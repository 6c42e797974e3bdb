/** What crosses the gallery's door (crates/gallery), and the conversation between the page and the gallery's worker. */

import type { Progress } from '../door';

/** One estimator on one drive. */
export interface Trial {
  name: string;
  /** `changes` are JSON: fields that replace those of the drive's file, empty for none. */
  source: { drive: string; changes: string; seed: number | null };
  estimator: string;
  /** JSON, empty for the defaults. */
  params: string;
  vehicle: string | null;
}

export interface Claim {
  id: string;
  place: string;
  says: string;
  remark: string;
  trials: Trial[];
}

export interface Paper {
  id: string;
  authors: string;
  title: string;
  setting: string;
  claims: Claim[];
}

export interface Figure {
  name: string;
  unit: string;
  value: number;
  claimed: number | null;
  /** From, to; infinite where there is no such limit. Without limits it informs and is not judged. */
  limits: [number, number] | null;
}

export type Verdict = 'supported' | 'partly' | 'not_supported';

export interface Finding {
  id: string;
  figures: Figure[];
  verdict: Verdict;
}

/** The claim being tried, as the worker sees it. */
export interface Attempt {
  run_some(budgetMs: number): Omit<Progress, 'stage'> & { stage: string };
  result(): Finding;
  free(): void;
}

export type ToWorker = { run: string } | { stop: true };
export type FromWorker =
  | { papers: Paper[] }
  | { running: string; fraction: number; stage: string }
  | { finding: Finding; seconds: number }
  | { failed: string; message: string }
  /** The module could not be loaded, or cannot go on. */
  | { dead: string };
