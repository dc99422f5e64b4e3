//! The Fourier transform of a small square, by halving (J. W. Cooley and J. W. Tukey, Math. Comput. 19, 1965).

/// Room for the transforms of a square, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Fourier {
    side: usize,
    /// `exp(i tau k / side)` for half a turn.
    turns: Vec<(f32, f32)>,
    real: Vec<f32>,
    imaginary: Vec<f32>,
}

impl Fourier {
    /// Multiplies the spectrum of a square of `side` x `side` values, a power of two, by a function of the wave number along x and
    /// y, in turns over the square's side; the function is even in both.
    pub fn filter(&mut self, values: &mut [f32], side: usize, response: impl Fn(f32, f32) -> f32) {
        if self.side != side {
            self.side = side;
            let turn = |k: usize| (std::f32::consts::TAU * k as f32 / side as f32).sin_cos();
            self.turns = (0..side / 2).map(turn).map(|(sin, cos)| (cos, sin)).collect();
        }
        self.real.clear();
        self.real.extend_from_slice(values);
        self.imaginary.clear();
        self.imaginary.resize(values.len(), 0.0);
        self.both(-1.0);
        let wave = |i: usize| if i > side / 2 { i as f32 - side as f32 } else { i as f32 };
        for i in 0..values.len() {
            let factor = response(wave(i % side), wave(i / side));
            self.real[i] *= factor;
            self.imaginary[i] *= factor;
        }
        self.both(1.0);
        let all = (side * side) as f32;
        for (out, value) in values.iter_mut().zip(&self.real) {
            *out = value / all;
        }
    }

    /// Transforms down the columns and across; `sign` -1 is the way there, +1 the way back, which is not divided by the number.
    fn both(&mut self, sign: f32) {
        for _ in 0..2 {
            self.columns(sign);
            // Two transpositions put everything back.
            for y in 0..self.side {
                for x in 0..y {
                    self.real.swap(y * self.side + x, x * self.side + y);
                    self.imaginary.swap(y * self.side + x, x * self.side + y);
                }
            }
        }
    }

    /// Transforms all columns at once: each step is one of whole rows.
    fn columns(&mut self, sign: f32) {
        let n = self.side;
        let mut j = 0;
        for i in 1..n {
            let mut bit = n >> 1;
            while j & bit != 0 {
                j ^= bit;
                bit >>= 1;
            }
            j |= bit;
            if i < j {
                for list in [&mut self.real, &mut self.imaginary] {
                    let (low, high) = list.split_at_mut(j * n);
                    low[i * n..(i + 1) * n].swap_with_slice(&mut high[..n]);
                }
            }
        }
        let mut size = 2;
        while size <= n {
            for block in (0..n).step_by(size) {
                for k in 0..size / 2 {
                    let (cos, sin) = self.turns[k * (n / size)];
                    self.pair(block + k, block + k + size / 2, (cos, sign * sin));
                }
            }
            size *= 2;
        }
    }

    /// Turns row `b` and puts the sum with row `a` and the difference in their places.
    fn pair(&mut self, a: usize, b: usize, (cos, sin): (f32, f32)) {
        let n = self.side;
        let (low, high) = self.real.split_at_mut(b * n);
        let (a_real, b_real) = (&mut low[a * n..(a + 1) * n], &mut high[..n]);
        let (low, high) = self.imaginary.split_at_mut(b * n);
        let (a_imaginary, b_imaginary) = (&mut low[a * n..(a + 1) * n], &mut high[..n]);
        let first = a_real.iter_mut().zip(a_imaginary);
        for ((ar, ai), (br, bi)) in first.zip(b_real.iter_mut().zip(b_imaginary)) {
            let (real, imaginary) = (*br * cos - *bi * sin, *br * sin + *bi * cos);
            (*br, *bi) = (*ar - real, *ai - imaginary);
            (*ar, *ai) = (*ar + real, *ai + imaginary);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_multiplied_by_its_response() {
        let side = 32;
        let wave = |i: usize| {
            let (x, y) = ((i % side) as f32, (i / side) as f32);
            (std::f32::consts::TAU * (3.0 * x + 5.0 * y) / side as f32 + 0.4).sin()
        };
        let mut values: Vec<f32> = (0..side * side).map(wave).collect();
        Fourier::default().filter(&mut values, side, |x, y| (x * x + y * y).sqrt());
        for (i, value) in values.iter().enumerate() {
            assert!((value - 34.0_f32.sqrt() * wave(i)).abs() < 1e-4, "{i}: {value}");
        }
    }
}
