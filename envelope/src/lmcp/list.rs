//! Arrays: counted in 16 bits, in 32, or of a fixed length.

use std::ops::{Deref, DerefMut};

use super::reader::{Decoded, Reader};
use super::schema::{Count, Kind};
use super::value::{List, Slot, Value, View};
use super::writer::{Encoded, Writer};

/// An array that the model allows to have more than 65 535 elements: its count takes 32 bits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LargeArray<T>(pub Vec<T>);

impl<T> Deref for LargeArray<T> {
    type Target = Vec<T>;
    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> DerefMut for LargeArray<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}

impl<T: Value> Value for Vec<T> {
    const KIND: Kind = Kind::List(&T::KIND, Count::U16);
    fn blank() -> Self {
        Self::new()
    }
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        let count = reader.u16()?.into();
        decode_elements(self, count, reader)
    }
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        writer.count16(self.len())?;
        encode_elements(self, writer)
    }
    fn view(&self) -> View<'_> {
        View::List(self)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::List(self)
    }
    fn apart(&self) -> usize {
        self.capacity() * size_of::<T>() + self.iter().map(T::apart).sum::<usize>()
    }
}

impl<T: Value> Value for LargeArray<T> {
    const KIND: Kind = Kind::List(&T::KIND, Count::U32);
    fn blank() -> Self {
        Self(Vec::new())
    }
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        let count = reader.u32()? as usize;
        decode_elements(&mut self.0, count, reader)
    }
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        writer.count32(self.len())?;
        encode_elements(self, writer)
    }
    fn view(&self) -> View<'_> {
        View::List(&self.0)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::List(&mut self.0)
    }
    fn apart(&self) -> usize {
        self.0.apart()
    }
}

impl<T: Value, const N: usize> Value for [T; N] {
    const KIND: Kind = Kind::List(&T::KIND, Count::Fixed(N));
    fn blank() -> Self {
        std::array::from_fn(|_| T::blank())
    }
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        decode_in_place(self, 0, reader)
    }
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        encode_elements(self, writer)
    }
    fn view(&self) -> View<'_> {
        View::List(self)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::List(self)
    }
    fn apart(&self) -> usize {
        self.iter().map(T::apart).sum()
    }
}

impl<T: Value> List for Vec<T> {
    fn length(&self) -> usize {
        self.len()
    }
    fn element(&self, index: usize) -> Option<View<'_>> {
        self.get(index).map(T::view)
    }
    fn truncate(&mut self, length: usize) {
        self.truncate(length);
    }
    fn place(&mut self, index: usize) -> Option<Slot<'_>> {
        if index == self.len() {
            self.push(T::blank());
        }
        self.get_mut(index).map(T::slot)
    }
    fn element_size(&self) -> usize {
        size_of::<T>()
    }
    fn room(&self) -> usize {
        self.capacity()
    }
    fn reserve(&mut self, more: usize) {
        self.reserve_exact(more);
    }
}

impl<T: Value, const N: usize> List for [T; N] {
    fn length(&self) -> usize {
        N
    }
    fn element(&self, index: usize) -> Option<View<'_>> {
        self.get(index).map(T::view)
    }
    fn truncate(&mut self, length: usize) {
        self.iter_mut().skip(length).for_each(|element| *element = T::blank());
    }
    fn place(&mut self, index: usize) -> Option<Slot<'_>> {
        self.get_mut(index).map(T::slot)
    }
    fn element_size(&self) -> usize {
        0
    }
    fn room(&self) -> usize {
        N
    }
    fn reserve(&mut self, _: usize) {}
}

/// Reads `count` elements, if so many can be in the bytes that are left. Room is made for as many as
/// these bytes can hold if none is null, and doubled while nulls are met.
fn decode_elements<T: Value>(list: &mut Vec<T>, count: usize, reader: &mut Reader<'_>) -> Decoded<()> {
    reader.bound(count, const { T::KIND.size_min() })?;
    list.clear();
    while list.len() < count {
        let read = list.len();
        let room = (reader.left() / const { T::KIND.size_full() } + 1).max(read).min(count - read);
        reader.allocate((read + room).saturating_mul(size_of::<T>()))?;
        if read == 0 {
            *list = Vec::with_capacity(room);
        } else {
            list.reserve_exact(room);
        }
        reader.release(read * size_of::<T>());
        list.resize_with(read + room, T::blank);
        decode_in_place(list, read, reader)?;
    }
    Ok(())
}

/// Reads the elements from `start` on.
fn decode_in_place<T: Value>(list: &mut [T], start: usize, reader: &mut Reader<'_>) -> Decoded<()> {
    for (index, element) in list.iter_mut().enumerate().skip(start) {
        element.decode(reader).map_err(|error| error.in_element(index))?;
    }
    Ok(())
}

fn encode_elements<T: Value>(list: &[T], writer: &mut Writer<'_>) -> Encoded {
    for (index, element) in list.iter().enumerate() {
        element.encode(writer).map_err(|error| error.in_element(index))?;
    }
    Ok(())
}
