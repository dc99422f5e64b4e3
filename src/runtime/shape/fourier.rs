//! The Fourier transform of a small square, by halving (J. W. Cooley and J. W. Tukey, Math. Comput. 19, 1965).

use glam::Vec2;

/// Transforms a line of complex numbers in place; their number is a power of two. `sign` -1 is the way there, +1 the way back, which
/// is not divided by the number.
fn transform(line: &mut [Vec2], sign: f32) {
    let n = line.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            j ^= bit;
            bit >>= 1;
        }
        j |= bit;
        if i < j {
            line.swap(i, j);
        }
    }
    let mut size = 2;
    while size <= n {
        let turn = Vec2::from_angle(sign * std::f32::consts::TAU / size as f32);
        for block in line.chunks_exact_mut(size) {
            let (low, high) = block.split_at_mut(size / 2);
            let mut factor = Vec2::X;
            for (a, b) in low.iter_mut().zip(high) {
                let turned = b.rotate(factor);
                (*a, *b) = (*a + turned, *a - turned);
                factor = factor.rotate(turn);
            }
        }
        size *= 2;
    }
}

/// Multiplies the spectrum of a square of `side` x `side` values, a power of two, by a function of the wave number along x and y,
/// in turns over the square's side.
pub(super) fn filter(values: &mut [f32], side: usize, response: impl Fn(f32, f32) -> f32) {
    let mut square: Vec<Vec2> = values.iter().map(|v| Vec2::new(*v, 0.0)).collect();
    let both = |square: &mut Vec<Vec2>, sign: f32| {
        for _ in 0..2 {
            for line in square.chunks_exact_mut(side) {
                transform(line, sign);
            }
            // Two transpositions put everything back.
            *square = (0..side * side).map(|i| square[i % side * side + i / side]).collect();
        }
    };
    both(&mut square, -1.0);
    let wave = |i: usize| if i > side / 2 { i as f32 - side as f32 } else { i as f32 };
    for (i, value) in square.iter_mut().enumerate() {
        *value *= response(wave(i % side), wave(i / side));
    }
    both(&mut square, 1.0);
    let all = (side * side) as f32;
    for (out, value) in values.iter_mut().zip(&square) {
        *out = value.x / all;
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
        filter(&mut values, side, |x, y| (x * x + y * y).sqrt());
        for (i, value) in values.iter().enumerate() {
            assert!((value - 34.0_f32.sqrt() * wave(i)).abs() < 1e-4, "{i}: {value}");
        }
    }
}
