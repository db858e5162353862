//! Numbers from the bytes of an input.

/// A queue of bytes. An empty queue gives zeros.
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let count = N.min(self.0.len());
        taken[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        taken
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        u8::from_le_bytes(self.take())
    }

    /// A whole number below `n`, which is at most 256.
    pub fn below(&mut self, n: usize) -> usize {
        usize::from(self.byte()) % n
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// Any 32-bit integer.
    pub fn integer(&mut self) -> i32 {
        i32::from_le_bytes(self.take())
    }

    /// Usually a number of the size of typical coefficients, sometimes any number.
    pub fn number(&mut self) -> f64 {
        match self.byte() {
            0..16 => f64::from_le_bytes(self.take()),
            16 => f64::NAN,
            17 => f64::INFINITY,
            18 => -0.0,
            _ => f64::from(i16::from_le_bytes(self.take())) / 4096.0,
        }
    }
}
