//! The wire form of ROS 2 messages: OMG's Common Data Representation, version 1, little-endian.

/// A message as it is written: a head of four bytes, then each number at a multiple of its own size.
#[derive(Debug, Clone, Default)]
pub(super) struct Cdr {
    bytes: Vec<u8>,
}

/// Plain CDR, little-endian, no options.
const HEAD: [u8; 4] = [0, 1, 0, 0];

impl Cdr {
    /// Begins a message; the memory of the last one is kept.
    pub fn begin(&mut self) {
        self.bytes.clear();
        self.bytes.extend(HEAD);
    }

    /// The message so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Pads to a multiple of `size` from the end of the head.
    fn align(&mut self, size: usize) {
        let past = (self.bytes.len() - HEAD.len()) % size;
        if past > 0 {
            self.bytes.resize(self.bytes.len() + size - past, 0);
        }
    }

    pub fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub fn bool(&mut self, value: bool) {
        self.bytes.push(u8::from(value));
    }

    pub fn i32(&mut self, value: i32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    /// The length of a sequence whose elements follow. Longer ones than 2^32 cannot be: a frame has 2^26 pixels at most.
    pub fn length(&mut self, count: usize) {
        self.u32(u32::try_from(count).unwrap_or(u32::MAX));
    }

    /// A string with its closing zero.
    pub fn string(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// A sequence of bytes.
    pub fn blob(&mut self, blob: &[u8]) {
        self.length(blob.len());
        self.bytes.extend(blob);
    }

    /// A sequence of bytes, four for each number.
    pub fn floats(&mut self, values: impl ExactSizeIterator<Item = f32>) {
        self.length(4 * values.len());
        for value in values {
            self.bytes.extend(value.to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut cdr = Cdr::default();
        for _ in 0..2 {
            cdr.begin();
            cdr.u8(7);
            cdr.f64(1.0);
            cdr.string("ab");
            cdr.u32(9);
        }
        let mut wanted = vec![0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        wanted.extend(1.0_f64.to_le_bytes());
        wanted.extend([3, 0, 0, 0, b'a', b'b', 0, 0, 9, 0, 0, 0]);
        assert_eq!(cdr.bytes(), wanted);
    }
}
