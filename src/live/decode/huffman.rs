//! Frames of Motion JPEG that leave out their Huffman tables.

use std::borrow::Cow;

/// Start of frame markers; a table stands before them.
const TABLES: u8 = 0xc4;
const SCAN: u8 = 0xda;

/// The tables of ISO/IEC 10918-1, annex K.3: class and number, codes of each length, values.
const DC_LENGTHS: [[u8; 16]; 2] =
    [[0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0], [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0]];
const DC_VALUES: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
const AC_LENGTHS: [[u8; 16]; 2] =
    [[0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 125], [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 119]];
const AC_LUMA: &[u8] = b"\
\x01\x02\x03\x00\x04\x11\x05\x12\x21\x31\x41\x06\x13\x51\x61\x07\x22\x71\x14\x32\x81\x91\xa1\x08\x23\x42\xb1\xc1\x15\x52\xd1\xf0\
\x24\x33\x62\x72\x82\x09\x0a\x16\x17\x18\x19\x1a\x25\x26\x27\x28\x29\x2a\x34\x35\x36\x37\x38\x39\x3a\x43\x44\x45\x46\x47\x48\x49\
\x4a\x53\x54\x55\x56\x57\x58\x59\x5a\x63\x64\x65\x66\x67\x68\x69\x6a\x73\x74\x75\x76\x77\x78\x79\x7a\x83\x84\x85\x86\x87\x88\x89\
\x8a\x92\x93\x94\x95\x96\x97\x98\x99\x9a\xa2\xa3\xa4\xa5\xa6\xa7\xa8\xa9\xaa\xb2\xb3\xb4\xb5\xb6\xb7\xb8\xb9\xba\xc2\xc3\xc4\xc5\
\xc6\xc7\xc8\xc9\xca\xd2\xd3\xd4\xd5\xd6\xd7\xd8\xd9\xda\xe1\xe2\xe3\xe4\xe5\xe6\xe7\xe8\xe9\xea\xf1\xf2\xf3\xf4\xf5\xf6\xf7\xf8\
\xf9\xfa";
const AC_CHROMA: &[u8] = b"\
\x00\x01\x02\x03\x11\x04\x05\x21\x31\x06\x12\x41\x51\x07\x61\x71\x13\x22\x32\x81\x08\x14\x42\x91\xa1\xb1\xc1\x09\x23\x33\x52\xf0\
\x15\x62\x72\xd1\x0a\x16\x24\x34\xe1\x25\xf1\x17\x18\x19\x1a\x26\x27\x28\x29\x2a\x35\x36\x37\x38\x39\x3a\x43\x44\x45\x46\x47\x48\
\x49\x4a\x53\x54\x55\x56\x57\x58\x59\x5a\x63\x64\x65\x66\x67\x68\x69\x6a\x73\x74\x75\x76\x77\x78\x79\x7a\x82\x83\x84\x85\x86\x87\
\x88\x89\x8a\x92\x93\x94\x95\x96\x97\x98\x99\x9a\xa2\xa3\xa4\xa5\xa6\xa7\xa8\xa9\xaa\xb2\xb3\xb4\xb5\xb6\xb7\xb8\xb9\xba\xc2\xc3\
\xc4\xc5\xc6\xc7\xc8\xc9\xca\xd2\xd3\xd4\xd5\xd6\xd7\xd8\xd9\xda\xe2\xe3\xe4\xe5\xe6\xe7\xe8\xe9\xea\xf2\xf3\xf4\xf5\xf6\xf7\xf8\
\xf9\xfa";

/// A JPEG with the standard Huffman tables put in where it has none, as frames of many webcams come.
pub fn with_huffman_tables(jpeg: &[u8]) -> Cow<'_, [u8]> {
    let Some(scan) = scan_without_tables(jpeg) else { return Cow::Borrowed(jpeg) };
    let mut segment = Vec::new();
    for (number, (dc, ac)) in DC_LENGTHS.iter().zip(&AC_LENGTHS).enumerate() {
        let values = if number == 0 { AC_LUMA } else { AC_CHROMA };
        segment.push(number as u8);
        segment.extend(dc);
        segment.extend(DC_VALUES);
        segment.push(0x10 | number as u8);
        segment.extend(ac);
        segment.extend(values);
    }
    let length = (segment.len() + 2) as u16;
    let mut whole = Vec::with_capacity(jpeg.len() + segment.len() + 4);
    whole.extend(&jpeg[..scan]);
    whole.extend([0xff, TABLES]);
    whole.extend(length.to_be_bytes());
    whole.extend(segment);
    whole.extend(&jpeg[scan..]);
    Cow::Owned(whole)
}

/// Where the scan begins, if no table stands before it.
fn scan_without_tables(jpeg: &[u8]) -> Option<usize> {
    let mut at = 2;
    loop {
        let [0xff, marker, high, low] = *jpeg.get(at..at + 4)? else { return None };
        match marker {
            TABLES => return None,
            SCAN => return Some(at),
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture;
    use super::*;

    /// The JPEG without its tables.
    fn stripped(jpeg: &[u8]) -> Vec<u8> {
        let mut out = jpeg[..2].to_vec();
        let mut at = 2;
        loop {
            let length = 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
            match jpeg[at + 1] {
                SCAN => break,
                TABLES => {}
                _ => out.extend(&jpeg[at..at + length]),
            }
            at += length;
        }
        out.extend(&jpeg[at..]);
        out
    }

    #[test]
    fn a_frame_without_tables_is_the_same_picture() {
        let rgb: Vec<u8> = (0..64 * 48 * 3).map(|i| ((i * 7) % 251) as u8).collect();
        let mut jpeg = Vec::new();
        let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 80);
        encoder.encode(&rgb, 64, 48, jpeg_encoder::ColorType::Rgb).unwrap();
        assert!(matches!(with_huffman_tables(&jpeg), Cow::Borrowed(_)));
        let bare = stripped(&jpeg);
        assert!(bare.len() + 400 < jpeg.len());
        let mended = with_huffman_tables(&bare);
        assert_eq!(picture(&mended).unwrap(), picture(&jpeg).unwrap());
        for cut in 0..bare.len().min(700) {
            let _ = with_huffman_tables(&bare[..cut]);
        }
    }
}
