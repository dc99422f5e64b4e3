//! The wire format of protocol buffers, as far as ONNX uses it: fields of varints, 32 and 64 bits, and bytes.

use crate::error::ModelError;

/// One field's content.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Wire<'a> {
    Varint(u64),
    Fixed32(u32),
    /// Doubles are not read.
    Fixed64,
    Bytes(&'a [u8]),
}

impl<'a> Wire<'a> {
    pub(crate) fn bytes(self, at: &str) -> Result<&'a [u8], ModelError> {
        match self {
            Self::Bytes(bytes) => Ok(bytes),
            _ => Err(ModelError::broken(format!("{at} is of the wrong wire type"))),
        }
    }

    pub(crate) fn text(self, at: &str) -> Result<String, ModelError> {
        let bytes = self.bytes(at)?.to_vec();
        String::from_utf8(bytes).map_err(|_| ModelError::broken(format!("{at} is no UTF-8 text")))
    }

    pub(crate) fn int(self, at: &str) -> Result<i64, ModelError> {
        match self {
            Self::Varint(value) => Ok(value as i64),
            _ => Err(ModelError::broken(format!("{at} is of the wrong wire type"))),
        }
    }

    /// Adds the integers of a repeated field, packed or not.
    pub(crate) fn ints_into(self, at: &str, list: &mut Vec<i64>) -> Result<(), ModelError> {
        match self {
            Self::Varint(value) => list.push(value as i64),
            Self::Bytes(mut rest) => {
                while !rest.is_empty() {
                    list.push(varint(&mut rest)? as i64);
                }
            }
            _ => return Err(ModelError::broken(format!("{at} is of the wrong wire type"))),
        }
        Ok(())
    }
}

fn varint(rest: &mut &[u8]) -> Result<u64, ModelError> {
    let mut value = 0_u64;
    for shift in (0..64).step_by(7) {
        let Some((byte, tail)) = rest.split_first() else {
            return Err(ModelError::broken("ends within a number"));
        };
        *rest = tail;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(value);
        }
    }
    Err(ModelError::broken("holds a number of more than 64 bits"))
}

fn take<'a>(rest: &mut &'a [u8], count: usize) -> Result<&'a [u8], ModelError> {
    let Some((head, tail)) = rest.split_at_checked(count) else {
        return Err(ModelError::broken(format!("ends {} bytes early", count - rest.len())));
    };
    *rest = tail;
    Ok(head)
}

/// The fields of a message, in their order.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    fn field(&mut self) -> Result<(u64, Wire<'a>), ModelError> {
        let rest = &mut self.0;
        let key = varint(rest)?;
        let wire = match key & 7 {
            0 => Wire::Varint(varint(rest)?),
            1 => take(rest, 8).map(|_| Wire::Fixed64)?,
            2 => {
                let length = usize::try_from(varint(rest)?).unwrap_or(usize::MAX);
                Wire::Bytes(take(rest, length)?)
            }
            5 => {
                let bytes = take(rest, 4)?.try_into().unwrap_or_default();
                Wire::Fixed32(u32::from_le_bytes(bytes))
            }
            other => return Err(ModelError::broken(format!("holds a field of wire type {other}"))),
        };
        Ok((key >> 3, wire))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u64, Wire<'a>), ModelError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_err() {
            self.0 = &[];
        }
        Some(field)
    }
}

/// A message that is being written.
#[derive(Debug, Default)]
pub(crate) struct Message(pub(crate) Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    pub(crate) fn int(&mut self, field: u64, value: i64) {
        self.varint(field << 3);
        self.varint(value as u64);
    }

    pub(crate) fn float(&mut self, field: u64, value: f32) {
        self.varint(field << 3 | 5);
        self.0.extend(value.to_le_bytes());
    }

    pub(crate) fn bytes(&mut self, field: u64, bytes: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend(bytes);
    }

    pub(crate) fn text(&mut self, field: u64, text: &str) {
        self.bytes(field, text.as_bytes());
    }

    /// A message within this one.
    pub(crate) fn message(&mut self, field: u64, fill: impl FnOnce(&mut Self)) {
        let mut inner = Self::default();
        fill(&mut inner);
        self.bytes(field, &inner.0);
    }
}
