//! A plain archive: POSIX ustar, the same bytes wherever it is written.

/// Bytes of a block.
const BLOCK: usize = 512;

/// An archive that grows.
#[derive(Debug, Default)]
pub struct Archive {
    bytes: Vec<u8>,
}

impl Archive {
    /// Adds a file. Owner, group and time are 0, so that nothing tells where and when it was made.
    pub fn add(&mut self, name: &str, content: &[u8]) {
        let mut header = [0_u8; BLOCK];
        let mut put = |at: usize, text: &[u8]| {
            header.iter_mut().skip(at).zip(text).for_each(|(to, from)| *to = *from);
        };
        // names are short: a key and a kind
        put(0, &name.as_bytes()[..name.len().min(100)]);
        put(100, b"0000644\0");
        put(108, b"0000000\0");
        put(116, b"0000000\0");
        put(124, format!("{:011o}\0", content.len()).as_bytes());
        put(136, b"00000000000\0");
        put(148, b"        ");
        put(156, b"0");
        put(257, b"ustar\x0000");
        put(329, b"0000000\0");
        put(337, b"0000000\0");
        let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
        let sum = format!("{sum:06o}\0 ");
        header.iter_mut().skip(148).zip(sum.as_bytes()).for_each(|(to, from)| *to = *from);
        self.bytes.extend_from_slice(&header);
        self.bytes.extend_from_slice(content);
        self.bytes.resize(self.bytes.len().div_ceil(BLOCK) * BLOCK, 0);
    }

    /// The archive with its end.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.resize(self.bytes.len() + 2 * BLOCK, 0);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_has_the_fields_of_the_standard() {
        let mut archive = Archive::default();
        archive.add("000001.json", b"{}");
        let bytes = archive.finish();
        assert_eq!(bytes.len(), 4 * BLOCK);
        assert_eq!(&bytes[257..265], b"ustar\x0000");
        assert_eq!(&bytes[124..136], b"00000000002\0");
        // the sum of the header's bytes with blanks in its own place
        let written = std::str::from_utf8(&bytes[148..154]).expect("digits");
        let sum: u32 = bytes[..BLOCK]
            .iter()
            .enumerate()
            .map(|(at, byte)| if (148..156).contains(&at) { u32::from(b' ') } else { u32::from(*byte) })
            .sum();
        assert_eq!(u32::from_str_radix(written, 8).expect("octal"), sum);
        assert_eq!(&bytes[BLOCK..BLOCK + 2], b"{}");
        assert!(bytes[2 * BLOCK..].iter().all(|byte| *byte == 0));
    }
}
