/** Curves with bands over time or distance: a thin layer over uPlot, which only draws. */

import uPlot from 'uplot';
import type { Signal } from '../signal';
import { DISTANCE_STEPS, distanceLabels, LEFT, RIGHT, rangeOf, TIME_STEPS, timeLabels, VALUE_STEPS, valueLabels, withBands } from './axes';
import { type Axis, axis } from './axis';
import type { Points } from './gaps';
import { CANVAS_FONT, type ColourName, palette } from './palette';

/** How a curve is drawn. */
export interface CurveStyle {
  colour: ColourName;
  width: number;
  dash?: number[];
  band?: ColourName;
  isStep?: boolean;
}

/** What a curve shows, in displayed units. */
export interface CurveData {
  line: Points;
  low?: Points;
  high?: Points;
  isShown: boolean;
  isBandShown: boolean;
}

export interface PlotOptions {
  styles: CurveStyle[];
  isLog: boolean;
  hasTimeAxis: boolean;
  /** Spacings of value ticks to choose from, where they are not decimal. */
  steps?: number[];
  /** So long, s, a filter takes to find its start; if more is shown, that does not set the range of values. */
  settling?: number;
  /** What it is drawn over, where that is not the axis of all plots. */
  axis?: Signal<Axis>;
}

/** Series of uPlot per curve: low edge, high edge, line. */
const PER_CURVE = 3;

export class TimePlot {
  #plot: uPlot;
  #options: PlotOptions;
  #host: HTMLElement;
  #axis: Signal<Axis>;
  /** The instants of the data and the window, s since the start of the drive. */
  #times: ArrayLike<number> = [];
  #window: [number, number] = [0, 1];
  #range: [number, number] = [-1, 1];

  constructor(host: HTMLElement, options: PlotOptions) {
    this.#host = host;
    this.#options = options;
    this.#axis = options.axis ?? axis;
    if (options.isLog) this.#range = [0.1, 10];
    this.#plot = this.#make(Math.max(host.clientWidth, 100), Math.max(host.clientHeight, 40));
    palette.on(() => this.#remake());
    this.#axis.on(() => {
      const [, ...columns] = this.#plot.data;
      this.#plot.setData([this.#places(), ...columns] as uPlot.AlignedData);
      this.#plot.redraw(false, true);
    });
  }

  /** Where an instant since the start of the drive stands. */
  #place(since: number): number {
    const { start, place } = this.#axis.value;
    return place(start + since);
  }

  #places(): number[] {
    return Array.from(this.#times, (since) => this.#place(since));
  }

  #remake(): void {
    const { data, width, height } = this.#plot;
    const shown = this.#plot.series.map((s) => s.show ?? true);
    this.#plot.destroy();
    this.#plot = this.#make(width, height);
    this.#plot.batch(() => shown.forEach((show, i) => i > 0 && this.#plot.setSeries(i, { show })));
    this.#plot.setData(data);
  }

  #make(width: number, height: number): uPlot {
    const { styles, isLog, hasTimeAxis } = this.#options;
    const colours = palette.value;
    const series: uPlot.Series[] = [{}];
    const bands: uPlot.Band[] = [];
    for (const style of styles) {
      const stepped = style.isStep ? uPlot.paths.stepped?.({ align: 1 }) : undefined;
      const common = { points: { show: false }, spanGaps: false, ...(stepped ? { paths: stepped } : {}) };
      const edge = series.length;
      if (style.band) bands.push({ series: [edge + 1, edge], fill: colours[style.band] });
      series.push({ ...common, width: 0, stroke: 'transparent' }, { ...common, width: 0, stroke: 'transparent' });
      series.push({ ...common, stroke: colours[style.colour], width: style.width, ...(style.dash ? { dash: style.dash } : {}) });
    }
    const axis = { stroke: colours.muted, font: CANVAS_FONT, grid: { stroke: colours.grid, width: 1 } };
    const options: uPlot.Options = {
      width,
      height,
      padding: [5, RIGHT, hasTimeAxis ? 0 : 5, 0],
      cursor: { show: false },
      legend: { show: false },
      series,
      bands,
      scales: {
        x: { time: false, range: () => [this.#place(this.#window[0]), this.#place(this.#window[1])] },
        y: isLog ? { distr: 3, range: () => this.#range } : { range: () => this.#range },
      },
      axes: [
        {
          ...axis,
          size: hasTimeAxis ? 22 : 0,
          gap: 3,
          space: 84,
          incrs: () => (this.#axis.value.kind === 'time' ? TIME_STEPS : DISTANCE_STEPS),
          ticks: { show: false },
          values: hasTimeAxis ? (_u, places, _axis, _space, spacing) => (this.#axis.value.kind === 'time' ? timeLabels : distanceLabels)(places, spacing) : () => [],
        },
        {
          ...axis,
          size: LEFT,
          gap: 5,
          space: isLog ? 16 : 15,
          ...(isLog ? { grid: { ...axis.grid, filter: (_u: uPlot, splits: number[]) => splits.map((v) => (isPower(v) ? v : null)) } } : { incrs: this.#options.steps ?? VALUE_STEPS }),
          ticks: { show: false },
          values: isLog
            ? (_u, values) => values.map((v) => (v !== null && isPower(v) ? powerLabel(v) : ''))
            : (_u, values, _axis, _space, spacing) => valueLabels(values, spacing),
        },
      ],
    };
    const empty: uPlot.AlignedData = [[], ...series.slice(1).map(() => [])];
    return new uPlot(options, empty, this.#host);
  }

  /** Draw curves on common instants, s since the start of the drive. `least` is the least height of the value axis. */
  setData(times: ArrayLike<number>, curves: CurveData[], least: number): void {
    const shown = curves.filter((c) => c.isShown);
    const from = settled(times, this.#options.settling ?? 0);
    this.#range = rangeOf(shown.map((c) => c.line.slice(from)), least, this.#options.isLog);
    const bands = shown.flatMap((c) => (c.low && c.high && c.isBandShown ? [[c.low.slice(from), c.high.slice(from)] as const] : []));
    if (!this.#options.isLog) this.#range = withBands(this.#range, bands);
    const none: Points = new Array(times.length).fill(null);
    const columns = curves.flatMap((c) => [c.low ?? none, c.high ?? none, c.line.length === times.length ? c.line : none]);
    const plot = this.#plot;
    this.#times = times;
    plot.batch(() => {
      curves.forEach((c, i) => {
        const isBand = c.isShown && c.isBandShown;
        [isBand, isBand, c.isShown].forEach((show, k) => {
          const index = 1 + PER_CURVE * i + k;
          if (plot.series[index]?.show !== show) plot.setSeries(index, { show });
        });
      });
      plot.setData([this.#places(), ...columns] as uPlot.AlignedData);
    });
  }

  /** Show a stretch of time, in the same seconds as the data's: since the start of the drive. */
  setWindow(t0: number, t1: number): void {
    this.#window = [t0, t1];
    this.#plot.setScale('x', { min: this.#place(t0), max: this.#place(t1) });
  }

  setSize(width: number, height: number): void {
    if (width < 50 || height < 20) return;
    this.#plot.setSize({ width, height });
  }

  /** The height of a displayed value below the plot's top, CSS px. */
  heightOf(value: number): number {
    return this.#plot.valToPos(value, 'y') + this.#plot.bbox.top / uPlot.pxRatio;
  }

  /** The displayed value at a height below the plot's top, CSS px. */
  valueAt(height: number): number {
    return this.#plot.posToVal(height - this.#plot.bbox.top / uPlot.pxRatio, 'y');
  }

  get canvas(): HTMLCanvasElement {
    return this.#plot.ctx.canvas;
  }
}

/** The first of some instants at which a filter has settled; 0 unless most of them are later. */
function settled(times: ArrayLike<number>, settling: number): number {
  let from = 0;
  while (from < times.length && (times[from] as number) < settling) from++;
  return from < 0.5 * times.length ? from : 0;
}

function isPower(value: number): boolean {
  const power = Math.log10(value);
  return Math.abs(power - Math.round(power)) < 1e-9;
}

function powerLabel(value: number): string {
  if (value >= 0.0001 && value < 100_000) return String(Number(value.toPrecision(3)));
  return value.toExponential(0).replace('e+', 'e').replace('-', '−');
}
