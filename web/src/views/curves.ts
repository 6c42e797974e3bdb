/** What the lanes of a view show, and whether the open drive has it. */

import type { CurveStyle } from '../plot/time-plot';
import type { EstimatorInfo } from '../door';
import { estimatorOf, type Store } from '../state';
import type { Quantity } from '../units';

/** Which result of an estimator is meant, or its errors against the truth. */
export type Which = 'current' | 'previous' | 'current_errors' | 'previous_errors';

/** A curve of a lane. */
export interface CurveSpec {
  id: string;
  label: string;
  /** What the legend calls it instead, where that depends on what is tuned. */
  name?: (store: Store) => string;
  /** `drive`, `truth`, or an estimator's name with the result meant. */
  source: 'drive' | 'truth' | 'level' | { estimator: string; which: Which };
  column: string;
  /** Column of the 1-sigma, drawn as a band. */
  sigma?: string;
  style: CurveStyle;
  isOn: boolean;
  /** The band is about zero: the curve is an error. */
  isError?: boolean;
  /** The value of a curve whose source is `level`. */
  level?: number;
  /** Values are single; each is held until the next one, so long at most, s. */
  hold?: number;
  /** What is drawn is the value without its sign. */
  isMagnitude?: boolean;
  /** What is drawn is this of the value; it is a line to judge others by, and in no table. */
  of?: (value: number) => number;
}

/** A plot of one quantity. */
export interface LaneSpec {
  key: string;
  title: string;
  quantity: Quantity;
  /** SI unit, shown for plain quantities. */
  unit: string;
  curves: CurveSpec[];
  isLog?: boolean;
  /** On a logarithmic axis, what is below is drawn here. */
  floor?: number;
  isCircular?: boolean;
  /** Least height of the value axis, SI. */
  least: number;
  /** It is not the last one of its view, but lowest where it is shown. */
  hasTimeAxis?: boolean;
  /** So long, s, a filter takes to find its start, which does not set the range of values. */
  settling?: number;
  /** Height relative to other lanes. */
  weight: number;
}

/** The name under which the core knows a curve's numbers now; null if there are none. */
export function sourceOf(store: Store, curve: CurveSpec): string | null {
  const { source, column } = curve;
  const report = store.report.value;
  if (!report) return null;
  if (source === 'level') return null;
  if (source === 'truth') return report.truth.includes(column) ? 'truth' : null;
  if (source === 'drive') return report.channels.some((c) => c.columns.includes(column)) ? 'drive' : null;
  const info = store.catalogue.value?.estimators.find((e) => e.name === estimatorOf(source.estimator));
  if (!info?.columns.some((c) => c.name === column)) return null;
  const { reply, running } = store.run(source.estimator).value;
  if (source.which.endsWith('_errors') && !hasTruthOf(store, info, column)) return null;
  if (source.which.startsWith('previous')) return reply?.previous ? `${source.estimator}:${source.which}` : null;
  if (source.which === 'current_errors') return reply ? `${source.estimator}:current_errors` : null;
  if (reply) return `${source.estimator}:current`;
  return running && running.rows > 0 ? `${source.estimator}:running` : null;
}

/** Whether the open drive has the truth of an estimator's column. */
export function hasTruthOf(store: Store, info: EstimatorInfo, column: string): boolean {
  const truth = info.columns.find((c) => c.name === column)?.truth;
  return truth !== null && truth !== undefined && (store.report.value?.truth.includes(truth) ?? false);
}

/** The estimators whose results a set of lanes shows. */
export function estimatorsOf(lanes: LaneSpec[]): string[] {
  const names = lanes.flatMap((lane) => lane.curves.flatMap((c) => (typeof c.source === 'object' ? [c.source.estimator] : [])));
  return [...new Set(names)];
}

/** The usual curves of a quantity: estimate with band, the estimate before, truth. */
export const STYLES: Record<'estimate' | 'second' | 'third' | 'blind' | 'truth' | 'ghost' | 'raw' | 'threshold', CurveStyle> = {
  estimate: { colour: 'estimate', width: 1.5, band: 'estimate-band' },
  second: { colour: 'second', width: 1.5, band: 'second-band' },
  third: { colour: 'third', width: 1.5, band: 'third-band' },
  blind: { colour: 'blind', width: 1.5, band: 'blind-band' },
  truth: { colour: 'truth', width: 1 },
  ghost: { colour: 'ghost', width: 1.2, dash: [4, 5] },
  raw: { colour: 'raw', width: 1 },
  threshold: { colour: 'threshold', width: 1.2, dash: [8, 3], isStep: true },
};
