//! Whether a square is smooth, and the smooth surface through its nodes.

use super::{Known, LARGEST, Lit};

/// Parts of the tolerance: within the first a square's middles are what its corners promise, for what a surface of the
/// second order then leaves, of the third, is a fraction of that; within the second its nodes are foreseen.
const PROMISED: f32 = 0.6;
const FORESEEN: f32 = 0.85;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Smooth,
    Rough,
    Misses,
}

/// The parabola through values at 0, 1 and 2.
#[derive(Clone, Copy)]
struct Parabola {
    start: f32,
    slope: f32,
    bend: f32,
}

impl Parabola {
    #[inline]
    fn through(a: f32, b: f32, c: f32) -> Self {
        Self { start: a, slope: b - a, bend: 0.5 * (c - 2.0 * b + a) }
    }

    #[inline]
    fn at(self, t: f32) -> f32 {
        self.start + t * (self.slope + (t - 1.0) * self.bend)
    }
}

impl<const N: usize> Lit<N> {
    pub(super) fn judge(&self, (x, y): (usize, usize), half: usize, tolerance: f32) -> Verdict {
        let nine = match self.nine((x, y), half) {
            Ok(nine) => nine,
            Err(verdict) => return verdict,
        };
        let [[a, ab, b], [ac, m, bd], [c, cd, d]] = nine;
        let smooth = (0..N).all(|n| {
            let off = [
                ab[n] - 0.5 * (a[n] + b[n]),
                cd[n] - 0.5 * (c[n] + d[n]),
                ac[n] - 0.5 * (a[n] + c[n]),
                bd[n] - 0.5 * (b[n] + d[n]),
                m[n] - 0.25 * (a[n] + b[n] + c[n] + d[n]),
            ];
            // Written so that a NaN, which no light gives, counts as rough.
            off.iter().all(|off| off.abs() <= PROMISED * tolerance)
        });
        if smooth || self.foreseen((x, y), half, tolerance) { Verdict::Smooth } else { Verdict::Rough }
    }

    /// The levels of a square's nine nodes.
    fn levels_at(&self, (x, y): (usize, usize), half: usize) -> [[[f32; N]; 3]; 3] {
        let mut nine = [[[0.0_f32; N]; 3]; 3];
        for (lane, levels) in self.levels.iter().enumerate() {
            for (j, nodes) in nine.iter_mut().enumerate() {
                let start = (y + j * half) * self.width + x;
                let row = levels.get(start..=start + 2 * half).unwrap_or_default();
                for (i, node) in nodes.iter_mut().enumerate() {
                    node[lane] = row.get(i * half).copied().unwrap_or(0.0);
                }
            }
        }
        nine
    }

    /// The nine nodes of a square, or what it is if they do not belong together.
    fn nine(&self, (x, y): (usize, usize), half: usize) -> Result<[[[f32; N]; 3]; 3], Verdict> {
        let nine = self.levels_at((x, y), half);
        let mut misses = 0;
        for j in 0..3 {
            let start = (y + j * half) * self.width + x;
            let row = self.known.get(start..=start + 2 * half).unwrap_or_default();
            misses += (0..3).filter(|i| row.get(i * half) != Some(&Known::Lit)).count();
        }
        match misses {
            0 => Ok(nine),
            9 => Err(Verdict::Misses),
            _ => Err(Verdict::Rough),
        }
    }

    /// Whether the surface through the nine nodes of the square that this one is a quarter of has told this one's own new
    /// nodes beforehand: it is of the third order, so what is left between this one's nodes is an eighth of its misses.
    fn foreseen(&self, (x, y): (usize, usize), half: usize, tolerance: f32) -> bool {
        let side = 2 * half;
        if side >= LARGEST {
            return false;
        }
        let (left, top) = (x / (2 * side) * (2 * side), y / (2 * side) * (2 * side));
        let Ok(nine) = self.nine((left, top), side) else { return false };
        let (x0, y0) = ((x - left) / half, (y - top) / half);
        let new = [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2)];
        (0..N).all(|lane| {
            let row = |j: usize| Parabola::through(nine[j][0][lane], nine[j][1][lane], nine[j][2][lane]);
            let rows = [row(0), row(1), row(2)];
            new.iter().all(|(i, j)| {
                let (u, v) = (0.5 * (x0 + i) as f32, 0.5 * (y0 + j) as f32);
                let told = Parabola::through(rows[0].at(u), rows[1].at(u), rows[2].at(u)).at(v);
                let (_, found) = self.node(x + i * half, y + j * half);
                (told - found[lane]).abs() <= FORESEEN * tolerance
            })
        })
    }

    /// Fills a square by the biquadratic surface through its nine nodes. Nodes keep their values, and a side that a
    /// neighbour has filled already gets the same parabola again.
    pub(super) fn biquadratic(&mut self, x: usize, y: usize, half: usize) {
        let nine = self.levels_at((x, y), half);
        match half {
            1 => self.lay::<3>(x, y, &nine),
            2 => self.lay::<5>(x, y, &nine),
            4 => self.lay::<9>(x, y, &nine),
            _ => self.lay::<17>(x, y, &nine),
        }
        let side = 2 * half;
        for j in 0..=side {
            let start = (y + j) * self.width + x;
            if let Some(row) = self.known.get_mut(start..=start + side) {
                row.fill(Known::Lit);
            }
        }
    }

    /// The surface over a square of so many pixels a side.
    fn lay<const SIDE: usize>(&mut self, x: usize, y: usize, nine: &[[[f32; N]; 3]; 3]) {
        let per_half = 2.0 / (SIDE - 1) as f32;
        let places: [f32; SIDE] = std::array::from_fn(|i| i as f32 * per_half);
        for (lane, levels) in self.levels.iter_mut().enumerate() {
            let column = |i: usize| Parabola::through(nine[0][i][lane], nine[1][i][lane], nine[2][i][lane]);
            let (left, middle, right) = (column(0), column(1), column(2));
            for (j, t) in places.iter().enumerate() {
                let start = (y + j) * self.width + x;
                let Some(row) = levels.get_mut(start..).and_then(|rest| rest.first_chunk_mut::<SIDE>())
                else {
                    continue;
                };
                // Along y in the three columns that are known, then along x.
                let across = Parabola::through(left.at(*t), middle.at(*t), right.at(*t));
                for (level, t) in row.iter_mut().zip(&places) {
                    *level = across.at(*t);
                }
            }
        }
    }
}
