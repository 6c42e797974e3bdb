/** The small picture of a raw column: a band from the least to the largest value of each part of its rows. */

const SPACE = 'http://www.w3.org/2000/svg';

/** Outline of the band in a box; empty where nothing was measured. Parts without a value break it. */
export function outline(picture: ArrayLike<number>, width: number, height: number): string {
  const parts = picture.length / 2;
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < parts; i++) {
    if (Number.isFinite(picture[2 * i])) {
      low = Math.min(low, picture[2 * i] as number);
      high = Math.max(high, picture[2 * i + 1] as number);
    }
  }
  if (low > high) return '';
  const x = (i: number): string => ((width * (i + 0.5)) / parts).toFixed(1);
  const y = (value: number): string => (high === low ? height / 2 : 1 + ((high - value) / (high - low)) * (height - 2)).toFixed(1);
  const stretches: number[][] = [];
  let open: number[] | null = null;
  for (let i = 0; i < parts; i++) {
    if (!Number.isFinite(picture[2 * i])) open = null;
    else if (open) open.push(i);
    else stretches.push((open = [i]));
  }
  return stretches
    .map((stretch) => {
      const above = stretch.map((i) => `${x(i)} ${y(picture[2 * i + 1] as number)}`);
      const below = stretch.map((i) => `${x(i)} ${y(picture[2 * i] as number)}`).reverse();
      return `M${[...above, ...below].join('L')}Z`;
    })
    .join('');
}

/** The picture, not read aloud: the range beside it says what it shows. */
export function sparkline(picture: ArrayLike<number>): SVGSVGElement {
  const [width, height] = [110, 26];
  const svg = document.createElementNS(SPACE, 'svg');
  svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
  svg.setAttribute('class', 'sparkline');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS(SPACE, 'path');
  path.setAttribute('d', outline(picture, width, height));
  svg.append(path);
  return svg;
}
