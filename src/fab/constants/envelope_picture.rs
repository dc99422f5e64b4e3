//! The picture of the load envelope.

use super::force_report::{ForceReport, PAPER_N};
use domecast_springs::Limit;

/// Told apart by people who see few colours too (Okabe and Ito's set).
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000"];

impl ForceReport {
    /// The border of pushes and presses at the pole, each stretch in the colour of what ends it.
    pub fn svg(&self) -> String {
        const WIDTH: f64 = 560.0;
        const HEIGHT: f64 = 420.0;
        const LEFT: f64 = 70.0;
        const TOP: f64 = 30.0;
        let most = |k: usize, sign: f64| self.border.iter().map(|(p, _)| sign * p[k]).fold(0.1, f64::max);
        let (push, press, pull) = (1.1 * most(0, 1.0), 1.1 * most(1, 1.0), 1.1 * most(1, -1.0));
        let x = |v: f64| LEFT + v / push * (WIDTH - LEFT - 20.0);
        let y = |v: f64| TOP + (press - v) / (press + pull) * (HEIGHT - TOP - 60.0);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" \
             fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"18\">Push and press at the pole until the first limit</text>\n"
        );
        let zero = y(0.0);
        text += &format!(
            "<path d=\"M{} {zero:.1}H{:.1}M{LEFT} {TOP}V{:.1}\" stroke=\"#444\" fill=\"none\"/>\n",
            LEFT,
            WIDTH - 20.0,
            HEIGHT - 60.0
        );
        let step = |span: f64| {
            let rough = 10_f64.powf((span / 5.0).log10().floor());
            [1.0, 2.0, 5.0, 10.0]
                .map(|m| m * rough)
                .into_iter()
                .find(|s| span / s <= 8.0)
                .unwrap_or(10.0 * rough)
        };
        let (dx, dy) = (step(push), step(press + pull));
        for i in 1..20 {
            let v = dx * f64::from(i);
            if v < push {
                text += &format!(
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n",
                    x(v),
                    zero + 16.0,
                    (v * 1e6).round() / 1e6
                );
            }
        }
        for i in -20..=20 {
            let v = dy * f64::from(i);
            if v < press && v > -pull {
                let label = (v * 1e6).round() / 1e6;
                let at = y(v);
                text += &format!(
                    "<path d=\"M{:.1} {at:.1}H{LEFT}\" stroke=\"#444\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                     text-anchor=\"end\">{label}</text>\n",
                    LEFT - 5.0,
                    LEFT - 9.0,
                    at + 4.0
                );
            }
        }
        text += &format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">push, N</text>\n<text x=\"8\" y=\"{:.1}\">press, \
             N</text>\n",
            WIDTH - 20.0,
            zero - 6.0,
            TOP - 12.0
        );
        let mut names: Vec<&str> = Vec::new();
        for pair in self.border.windows(2) {
            let [(a, _), (b, limit)] = pair else { continue };
            let name = limit.map_or("nothing", Limit::as_str);
            if !names.contains(&name) {
                names.push(name);
            }
            let color = COLORS[names.iter().position(|n| *n == name).unwrap_or(0) % COLORS.len()];
            text += &format!(
                "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{color}\" stroke-width=\"3\" \
                 stroke-linecap=\"round\"/>\n",
                x(a[0]),
                y(a[1]),
                x(b[0]),
                y(b[1])
            );
        }
        if press > PAPER_N {
            text += &format!(
                "<circle cx=\"{LEFT}\" cy=\"{:.1}\" r=\"4\"/><text x=\"{:.1}\" y=\"{:.1}\">the paper's 17 N</text>\n",
                y(PAPER_N),
                LEFT + 9.0,
                y(PAPER_N) + 4.0
            );
        }
        for (i, name) in names.iter().enumerate() {
            let at = LEFT + 165.0 * (i % 3) as f64;
            let row = HEIGHT - 34.0 + 18.0 * (i / 3) as f64;
            text += &format!(
                "<path d=\"M{at:.1} {:.1}h18\" stroke=\"{}\" stroke-width=\"3\"/><text x=\"{:.1}\" \
                 y=\"{row:.1}\">{}</text>\n",
                row - 4.0,
                COLORS[i % COLORS.len()],
                at + 24.0,
                name.replace('_', " ")
            );
        }
        text + "</svg>\n"
    }
}
