//! Log-log pictures of ladders: error over time, as SVG and as PNG.

use std::fmt::Write as _;

use glam::DVec2;
use tiny_skia::Pixmap;

use super::ladder::{Ladder, Rung};
use domecast_fab::artwork::canvas;
use domecast_fab::artwork::canvas::color;
use domecast_fab::artwork::strokes::{pen_mm, strokes};

const SIZE: DVec2 = DVec2::new(640.0, 430.0);
/// Corners of the plot: left, top, right, bottom.
const PLOT: [f64; 4] = [86.0, 62.0, 610.0, 366.0];
const INK: [u8; 3] = [40, 40, 40];
const FAINT: [u8; 3] = [222, 222, 222];
const DOMINATED: [u8; 3] = [150, 150, 150];
const FRONT: [u8; 3] = [0, 114, 178];
const IN_USE: [u8; 3] = [213, 94, 0];
const MEETS: [u8; 3] = [0, 158, 115];

/// What a picture is made of, px, y down.
enum Mark {
    Line { points: Vec<DVec2>, rgb: [u8; 3], width: f64 },
    Disc { at: DVec2, radius: f64, rgb: [u8; 3], filled: bool },
    Words { at: DVec2, anchor: f64, height: f64, rgb: [u8; 3], words: String },
}

/// A picture of one ladder.
pub struct Chart {
    title: String,
    marks: Vec<Mark>,
}

impl Chart {
    /// The ladder's rungs by time and error, the Pareto front, what is in use and what meets the design's accuracy.
    /// `None` where no rung has an error and a time that a logarithm takes.
    pub fn of(ladder: &Ladder) -> Option<Self> {
        let floor = ladder.blind_below();
        let error = |rung: &Rung| rung.max_error.max(floor).max(f64::MIN_POSITIVE);
        let usable =
            |rung: &&Rung| rung.max_error.is_finite() && rung.time.median_s > 0.0 && error(rung) > 1e-300;
        let rungs: Vec<&Rung> = ladder.rungs.iter().filter(usable).collect();
        let mut errors: Vec<f64> = rungs.iter().map(|rung| error(rung)).collect();
        errors.extend(ladder.asked.filter(|asked| *asked > 0.0));
        let per_item = |rung: &Rung, seconds: f64| seconds * rung.per_item_s / rung.time.median_s;
        // The axis holds the spread as well.
        let spread = |rung: &&Rung| {
            let time = rung.time;
            [time.lower_quartile_s, time.median_s, time.upper_quartile_s].map(|s| per_item(rung, s))
        };
        let times: Vec<f64> = rungs.iter().flat_map(spread).collect();
        let (across, up) = (Axis::over(&times)?, Axis::over(&errors)?);
        let place = |time: f64, error: f64| {
            DVec2::new(
                PLOT[0] + across.share(time) * (PLOT[2] - PLOT[0]),
                PLOT[3] - up.share(error) * (PLOT[3] - PLOT[1]),
            )
        };
        let mut chart = Self { title: ladder.title.clone(), marks: Vec::new() };
        chart.words(DVec2::new(16.0, 24.0), 0.0, 11.0, INK, &ladder.title);
        chart.words(DVec2::new(16.0, 42.0), 0.0, 7.0, INK, &format!("error, {}", ladder.unit));
        let caption = format!("time for one {}, s", ladder.item);
        chart.words(DVec2::new(PLOT[2], PLOT[3] + 32.0), 1.0, 7.0, INK, &caption);
        for decade in across.decades() {
            let x = place(10_f64.powi(decade), 1.0).x;
            chart.line(&[DVec2::new(x, PLOT[1]), DVec2::new(x, PLOT[3])], FAINT, 1.0);
            chart.words(DVec2::new(x, PLOT[3] + 15.0), 0.5, 6.0, INK, &format!("1e{decade}"));
        }
        for decade in up.decades().step_by(up.label_step()) {
            let y = place(1.0, 10_f64.powi(decade)).y;
            chart.line(&[DVec2::new(PLOT[0], y), DVec2::new(PLOT[2], y)], FAINT, 1.0);
            chart.words(DVec2::new(PLOT[0] - 8.0, y + 3.0), 1.0, 6.0, INK, &format!("1e{decade}"));
        }
        chart.line(
            &[DVec2::new(PLOT[0], PLOT[1]), DVec2::new(PLOT[0], PLOT[3]), DVec2::new(PLOT[2], PLOT[3])],
            INK,
            1.5,
        );
        if let Some(asked) = ladder.asked {
            let y = place(1.0, asked).y;
            chart.line(&[DVec2::new(PLOT[0], y), DVec2::new(PLOT[2], y)], MEETS, 1.5);
            let words = format!("asked: {} {}", super::sparse(asked), ladder.unit);
            chart.words(DVec2::new(PLOT[2], y - 5.0), 1.0, 6.0, MEETS, &words);
        }
        let mut front: Vec<&Rung> = rungs.iter().copied().filter(|rung| !rung.dominated).collect();
        front.sort_by(|a, b| a.time.median_s.total_cmp(&b.time.median_s));
        let line: Vec<DVec2> = front.iter().map(|rung| place(rung.per_item_s, error(rung))).collect();
        chart.line(&line, FRONT, 2.0);
        for rung in &rungs {
            let at = place(rung.per_item_s, error(rung));
            let rgb = if rung.dominated { DOMINATED } else { FRONT };
            let spread = [rung.time.lower_quartile_s, rung.time.upper_quartile_s]
                .map(|seconds| place(per_item(rung, seconds), error(rung)));
            chart.line(&spread, rgb, 1.0);
            chart.marks.push(Mark::Disc { at, radius: 4.0, rgb, filled: !rung.dominated });
        }
        for (index, rgb, ring) in [(ladder.in_use, IN_USE, 8.0), (ladder.meets, MEETS, 11.0)] {
            if let Some(rung) = index.and_then(|index| ladder.rungs.get(index)).filter(|rung| usable(rung)) {
                let at = place(rung.per_item_s, error(rung));
                chart.marks.push(Mark::Disc { at, radius: ring, rgb, filled: false });
            }
        }
        chart.legend(ladder);
        Some(chart)
    }

    fn legend(&mut self, ladder: &Ladder) {
        let y = SIZE.y - 14.0;
        let named = |index: Option<usize>| {
            index.and_then(|index| ladder.rungs.get(index)).map(|rung| rung.label.clone())
        };
        let mut entries = vec![(FRONT, "best at its time".to_owned()), (DOMINATED, "beaten".to_owned())];
        entries.extend(named(ladder.in_use).map(|label| (IN_USE, format!("in use: {label}"))));
        entries.extend(named(ladder.meets).map(|label| (MEETS, format!("enough: {label}"))));
        let mut x = 16.0;
        for (rgb, words) in entries {
            let filled = rgb == FRONT;
            self.marks.push(Mark::Disc { at: DVec2::new(x + 4.0, y - 3.0), radius: 4.0, rgb, filled });
            self.words(DVec2::new(x + 13.0, y), 0.0, 5.5, INK, &words);
            x += 13.0 + words.chars().count() as f64 * 5.1 + 12.0;
        }
    }

    fn line(&mut self, points: &[DVec2], rgb: [u8; 3], width: f64) {
        if points.len() > 1 {
            self.marks.push(Mark::Line { points: points.to_vec(), rgb, width });
        }
    }

    fn words(&mut self, at: DVec2, anchor: f64, height: f64, rgb: [u8; 3], words: &str) {
        self.marks.push(Mark::Words { at, anchor, height, rgb, words: words.to_owned() });
    }

    /// As SVG.
    pub fn to_svg(&self) -> String {
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
             font-family=\"sans-serif\" role=\"img\"><title>{2}</title>\n<rect width=\"100%\" height=\"100%\" \
             fill=\"white\"/>\n",
            SIZE.x,
            SIZE.y,
            super::page::escape(&self.title)
        );
        let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
        for mark in &self.marks {
            let _ = match mark {
                Mark::Line { points, rgb, width } => {
                    let path: Vec<String> = points.iter().map(|p| format!("{:.1} {:.1}", p.x, p.y)).collect();
                    writeln!(
                        text,
                        "<path d=\"M{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"/>",
                        path.join("L"),
                        hex(*rgb)
                    )
                }
                Mark::Disc { at, radius, rgb, filled } => writeln!(
                    text,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" stroke-width=\"1.5\" stroke=\"{}\" \
                     fill=\"{}\"/>",
                    at.x,
                    at.y,
                    hex(*rgb),
                    if *filled { hex(*rgb) } else { "none".into() }
                ),
                Mark::Words { at, anchor, height, rgb, words } => writeln!(
                    text,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{}\" font-size=\"{:.1}\" fill=\"{}\">{}</text>",
                    at.x,
                    at.y,
                    ["start", "middle", "end"][(2.0 * anchor) as usize % 3],
                    1.6 * height,
                    hex(*rgb),
                    super::page::escape(words)
                ),
            };
        }
        text + "</svg>\n"
    }

    /// As PNG, twice as many pixels each way, in a lettering that needs no font; `None` if it could not be packed.
    pub fn to_png(&self) -> Option<Vec<u8>> {
        const SCALE: f64 = 2.0;
        let mut picture = Pixmap::new((SIZE.x * SCALE) as u32, (SIZE.y * SCALE) as u32)?;
        picture.fill(color([255; 3]));
        for mark in &self.marks {
            match mark {
                Mark::Line { points, rgb, width } => {
                    let points: Vec<DVec2> = points.iter().map(|p| *p * SCALE).collect();
                    canvas::stroke(&mut picture, &points, false, (width * SCALE) as f32, *rgb);
                }
                Mark::Disc { at, radius, rgb, filled } => {
                    let rim: Vec<DVec2> = (0..32)
                        .map(|k| DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 32.0))
                        .map(|way| (*at + way * *radius) * SCALE)
                        .collect();
                    if *filled {
                        canvas::fill(&mut picture, &rim, *rgb);
                    } else {
                        canvas::stroke(&mut picture, &rim, true, (1.5 * SCALE) as f32, *rgb);
                    }
                }
                Mark::Words { at, anchor, height, rgb, words } => {
                    let height = height * SCALE;
                    let width = words.chars().count() as f64 * 5.5 / 6.0 * height;
                    let start = *at * SCALE - DVec2::new(anchor * width, 0.0);
                    for stroke in strokes(words, DVec2::ZERO, height) {
                        let points: Vec<DVec2> =
                            stroke.iter().map(|p| start + DVec2::new(p.x, -p.y)).collect();
                        canvas::stroke(&mut picture, &points, false, pen_mm(height) as f32, *rgb);
                    }
                }
            }
        }
        picture.encode_png().ok()
    }
}

/// A logarithmic axis over whole decades.
struct Axis {
    low: i32,
    high: i32,
}

impl Axis {
    fn over(values: &[f64]) -> Option<Self> {
        let logs = || values.iter().filter(|v| v.is_finite() && **v > 0.0).map(|v| v.log10());
        let (low, high) = (logs().reduce(f64::min)?.floor() as i32, logs().reduce(f64::max)?.ceil() as i32);
        Some(Self { low, high: high.max(low + 1) })
    }

    fn share(&self, value: f64) -> f64 {
        (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low)
    }

    fn decades(&self) -> std::ops::RangeInclusive<i32> {
        self.low..=self.high
    }

    fn label_step(&self) -> usize {
        ((self.high - self.low) as usize).div_ceil(9).max(1)
    }
}
