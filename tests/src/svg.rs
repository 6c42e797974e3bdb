//! A plot of a few curves as SVG, for the documents: small, and the same text on every machine but for the last digit.

use std::fmt::Write;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 48.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 36.0;

/// A curve: name, colour, width, points.
pub struct Curve<'a> {
    /// What the key calls it.
    pub name: &'a str,
    /// As CSS writes it.
    pub colour: &'a str,
    /// Of the line, px.
    pub width: f64,
    /// In the axes' units.
    pub points: Vec<(f64, f64)>,
}

/// Curves over common axes; `x` and `y` are label, start, end and step of each.
pub fn plot(title: &str, x: (&str, f64, f64, f64), y: (&str, f64, f64, f64), curves: &[Curve]) -> String {
    let across = |v: f64| LEFT + (v - x.1) / (x.2 - x.1) * (WIDTH - LEFT - 12.0);
    let down = |v: f64| TOP + (y.2 - v) / (y.2 - y.1) * (HEIGHT - TOP - BOTTOM);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"12\" role=\"img\">\n<title>{title}</title>\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
    );
    let steps = |from: f64, to: f64, step: f64| {
        (0..=((to - from) / step).round() as usize).map(move |k| from + k as f64 * step)
    };
    for v in steps(x.1, x.2, x.3) {
        let (at, low) = (across(v), HEIGHT - BOTTOM);
        let _ = writeln!(out, "<path d=\"M{at:.1} {TOP}V{low}\" stroke=\"#e4e8eb\"/>");
        let _ = writeln!(out, "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{v}</text>", low + 15.0);
    }
    for v in steps(y.1, y.2, y.3) {
        let at = down(v);
        let _ = writeln!(out, "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#e4e8eb\"/>", WIDTH - 12.0);
        let _ = writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{v}</text>", LEFT - 5.0, at + 4.0);
    }
    let _ =
        writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", WIDTH - 12.0, HEIGHT - 4.0, x.0);
    let _ = writeln!(out, "<text x=\"6\" y=\"{:.1}\">{}</text>", TOP - 8.0, y.0);
    for (k, curve) in curves.iter().enumerate() {
        let key = 15.0 + 14.0 * k as f64 - 3.0;
        let (colour, width) = (curve.colour, curve.width);
        let _ = writeln!(out, "<path d=\"M120 {:.1}h22\" stroke=\"{colour}\" stroke-width=\"{width}\"/>", key - 4.0);
        let _ = writeln!(out, "<text x=\"148\" y=\"{key:.1}\">{}</text>", curve.name);
        let mut path = String::new();
        for (index, point) in curve.points.iter().enumerate() {
            let letter = if index == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{letter}{:.1} {:.1}", across(point.0), down(point.1));
        }
        let _ = writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>");
    }
    out.push_str("</svg>\n");
    out
}
