//! Whether a square is smooth, and the smooth surface through its nodes.

use glam::Vec4;

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

/// The parabola through levels at 0, 1 and 2.
#[derive(Clone, Copy)]
struct Parabola {
    start: Vec4,
    slope: Vec4,
    bend: Vec4,
}

impl Parabola {
    #[inline]
    fn through([a, b, c]: [Vec4; 3]) -> Self {
        Self { start: a, slope: b - a, bend: 0.5 * (c - 2.0 * b + a) }
    }

    #[inline]
    fn at(self, t: f32) -> Vec4 {
        self.start + (self.slope + self.bend * (t - 1.0)) * t
    }
}

/// Levels of nine nodes, by row.
type Nine = [[Vec4; 3]; 3];

impl Lit {
    pub(super) fn judge(&self, (x, y): (usize, usize), half: usize, tolerance: f32) -> Verdict {
        let nine = match self.nine((x, y), half) {
            Ok(nine) => nine,
            Err(verdict) => return verdict,
        };
        let [[a, ab, b], [ac, m, bd], [c, cd, d]] = nine;
        let off = [
            ab - 0.5 * (a + b),
            cd - 0.5 * (c + d),
            ac - 0.5 * (a + c),
            bd - 0.5 * (b + d),
            m - 0.25 * (a + b + c + d),
        ];
        let smooth = off.iter().all(|off| self.is_within(*off, PROMISED * tolerance));
        if smooth || self.foreseen((x, y), half, tolerance) { Verdict::Smooth } else { Verdict::Rough }
    }

    /// Whether the channels asked for are off by no more. A NaN, which no light gives, is further off.
    #[inline]
    fn is_within(&self, off: Vec4, tolerance: f32) -> bool {
        (off * self.asked).abs().cmple(Vec4::splat(tolerance)).all()
    }

    /// The levels of a square's nine nodes.
    #[inline]
    fn levels_at(&self, (x, y): (usize, usize), half: usize) -> Nine {
        std::array::from_fn(|j| {
            let start = (y + j * half) * self.width + x;
            let row = self.levels.get(start..=start + 2 * half).unwrap_or_default();
            std::array::from_fn(|i| row.get(i * half).copied().unwrap_or(Vec4::ZERO))
        })
    }

    /// The nine nodes of a square, or what it is if they do not belong together.
    fn nine(&self, (x, y): (usize, usize), half: usize) -> Result<Nine, Verdict> {
        let mut misses = 0;
        for j in 0..3 {
            let start = (y + j * half) * self.width + x;
            let row = self.known.get(start..=start + 2 * half).unwrap_or_default();
            misses += (0..3).filter(|i| row.get(i * half) != Some(&Known::Lit)).count();
        }
        match misses {
            0 => Ok(self.levels_at((x, y), half)),
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
        let rows = nine.map(Parabola::through);
        new.iter().all(|(i, j)| {
            let (u, v) = (0.5 * (x0 + i) as f32, 0.5 * (y0 + j) as f32);
            let told = Parabola::through(rows.map(|row| row.at(u))).at(v);
            let (_, found) = self.node(x + i * half, y + j * half);
            self.is_within(told - found, FORESEEN * tolerance)
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
            8 => self.lay::<17>(x, y, &nine),
            _ => self.lay::<33>(x, y, &nine),
        }
    }

    /// The surface over a square of so many pixels a side.
    fn lay<const SIDE: usize>(&mut self, x: usize, y: usize, nine: &Nine) {
        let per_half = 2.0 / (SIDE - 1) as f32;
        let columns = [0, 1, 2].map(|i| Parabola::through([nine[0][i], nine[1][i], nine[2][i]]));
        for j in 0..SIDE {
            let start = (y + j) * self.width + x;
            let Some(row) = self.levels.get_mut(start..).and_then(|rest| rest.first_chunk_mut::<SIDE>())
            else {
                continue;
            };
            // Along y in the three columns that are known, then along x.
            let across = Parabola::through(columns.map(|column| column.at(j as f32 * per_half)));
            for (i, level) in row.iter_mut().enumerate() {
                *level = across.at(i as f32 * per_half);
            }
            let known = self.known.get_mut(start..).and_then(|rest| rest.first_chunk_mut::<SIDE>());
            known.into_iter().for_each(|row| *row = [Known::Lit; SIDE]);
        }
    }
}
