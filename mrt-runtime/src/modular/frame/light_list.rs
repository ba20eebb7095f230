//! The lights of a frame, by ids that stay valid when other lights are removed.

use crate::level::placed::PlacedLevel;
use crate::light::limits::MAX_LIGHTS;
use crate::light::placed::{PlacedLight, place};
use crate::light::source::{Light, LightError};
use std::fmt;

/// Names a light of a frame until the light is removed; afterwards it names no light. Other frames have ids of their
/// own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightId {
    slot: u32,
    generation: u32,
}

impl fmt::Display for LightId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.generation {
            0 => self.slot.fmt(f),
            generation => write!(f, "{}.{generation}", self.slot),
        }
    }
}

/// A light that a frame skipped, and why.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("light {id}: {reason}")]
pub struct SkippedLight {
    /// The light.
    pub id: LightId,
    /// Why it was skipped.
    pub reason: LightError,
}

/// The lights of a frame in slots, which ids name, and those that may shine in places.
#[derive(Debug)]
pub(super) struct LightList {
    slots: Vec<Slot>,
    /// Slots without a light; the last one is used first.
    free_slots: Vec<u32>,
    /// At most [`MAX_LIGHTS`] places. A place without a light, or whose light is skipped, is off.
    placed: Vec<PlacedLight>,
    /// Places without a light; the last one is used first.
    free_places: Vec<u32>,
    /// Number of slots whose light is skipped.
    skipped: usize,
}

#[derive(Debug)]
struct Slot {
    generation: u32,
    light: Option<Light>,
    /// `None` for a slot without a light, and for lights beyond [`MAX_LIGHTS`].
    place: Option<u32>,
    error: Option<LightError>,
}

impl LightList {
    /// No lights. Up to [`MAX_LIGHTS`] of them allocate nothing.
    pub(super) fn new() -> Self {
        // Room for all lights that may shine, so that a frame to which lights are added allocates nothing.
        Self {
            slots: Vec::with_capacity(MAX_LIGHTS),
            free_slots: Vec::with_capacity(MAX_LIGHTS),
            placed: Vec::with_capacity(MAX_LIGHTS),
            free_places: Vec::with_capacity(MAX_LIGHTS),
            skipped: 0,
        }
    }

    /// Lights to shine, and between them lights that are off.
    pub(super) fn placed(&self) -> &[PlacedLight] {
        &self.placed
    }

    pub(super) fn add(&mut self, level: &PlacedLevel, light: Light) -> LightId {
        let slot = self.free_slots.pop().unwrap_or_else(|| {
            self.slots.push(Slot {
                generation: 0,
                light: None,
                place: None,
                error: None,
            });
            self.slots.len() as u32 - 1
        });
        self.slots[slot as usize].place = self.take_place();
        self.put(level, slot, Some(light));
        self.id(slot)
    }

    fn take_place(&mut self) -> Option<u32> {
        if self.free_places.is_empty() && self.placed.len() < MAX_LIGHTS {
            self.placed.push(PlacedLight::OFF);
            return Some(self.placed.len() as u32 - 1);
        }
        self.free_places.pop()
    }

    /// False if the light was removed.
    pub(super) fn set(&mut self, level: &PlacedLevel, id: LightId, light: Light) -> bool {
        let exists = self.get(id).is_some();
        if exists {
            self.put(level, id.slot, Some(light));
        }
        exists
    }

    /// Removes a light and returns it; `None` if it was removed before. If a light is skipped because there were too
    /// many, it takes the place that gets free.
    pub(super) fn remove(&mut self, level: &PlacedLevel, id: LightId) -> Option<Light> {
        let light = self.get(id)?;
        self.clear(level, id.slot);
        self.free_slots.push(id.slot);
        let is_waiting = |slot: &Slot| slot.light.is_some() && slot.place.is_none();
        if self.slots.len() > MAX_LIGHTS
            && let Some(waiting) = self.slots.iter().position(is_waiting)
        {
            self.slots[waiting].place = self.take_place();
            self.put(level, waiting as u32, self.slots[waiting].light);
        }
        Some(light)
    }

    /// Takes the light out of a slot, and frees its place.
    fn clear(&mut self, level: &PlacedLevel, slot: u32) {
        self.put(level, slot, None);
        let at = &mut self.slots[slot as usize];
        at.generation = at.generation.wrapping_add(1);
        self.free_places.extend(at.place.take());
    }

    pub(super) fn get(&self, id: LightId) -> Option<Light> {
        let slot = self.slots.get(id.slot as usize)?;
        slot.light.filter(|_| slot.generation == id.generation)
    }

    /// Replaces all lights: the k-th light takes slot k and place k.
    pub(super) fn replace(&mut self, level: &PlacedLevel, lights: &[Light]) {
        for slot in 0..self.slots.len() as u32 {
            self.clear(level, slot);
        }
        self.free_slots.clear();
        self.free_slots.extend((0..self.slots.len() as u32).rev());
        self.free_places.clear();
        self.free_places.extend((0..self.placed.len() as u32).rev());
        for &light in lights {
            self.add(level, light);
        }
    }

    /// Finds the blocks of all lights again, in another level.
    pub(super) fn place_in(&mut self, level: &PlacedLevel) {
        for slot in 0..self.slots.len() {
            self.put(level, slot as u32, self.slots[slot].light);
        }
    }

    /// Ids of all lights, in the order of their slots.
    pub(super) fn ids(&self) -> impl Iterator<Item = LightId> + '_ {
        let slots = (0..).zip(&self.slots);
        let taken = slots.filter(|(_, slot)| slot.light.is_some());
        taken.map(|(slot, _)| self.id(slot))
    }

    /// Appends the lights that are skipped to `out`.
    pub(super) fn list_skipped(&self, out: &mut Vec<SkippedLight>) {
        if self.skipped == 0 {
            return;
        }
        for (slot, at) in (0..).zip(&self.slots) {
            if let Some(reason) = at.error {
                let id = self.id(slot);
                out.push(SkippedLight { id, reason });
            }
        }
    }

    fn id(&self, slot: u32) -> LightId {
        let generation = self.slots[slot as usize].generation;
        LightId { slot, generation }
    }

    /// Puts a light into a slot, and into the slot's place.
    fn put(&mut self, level: &PlacedLevel, slot: u32, light: Option<Light>) {
        let at = &mut self.slots[slot as usize];
        let index = at.place.map(|place| place as usize);
        let placed = index.and_then(|index| self.placed.get_mut(index));
        let found = match (light, &placed) {
            (None, _) => Ok(PlacedLight::OFF),
            (Some(_), None) => Err(LightError::TooMany),
            (Some(light), Some(_)) => place(level, light),
        };
        self.skipped -= usize::from(at.error.is_some());
        (at.light, at.error) = (light, found.err());
        self.skipped += usize::from(at.error.is_some());
        if let Some(placed) = placed {
            *placed = found.unwrap_or(PlacedLight::OFF);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::block::Level;
    use crate::modular::assemble::config::AssembleConfig;
    use crate::modular::dictionary::Dictionary;
    use crate::modular::scene::Scene;
    use glam::Vec3;

    #[test]
    fn a_light_too_many_shines_once_another_is_removed() {
        let bytes = include_bytes!("../../../../assets/versions/2.mrt");
        let dictionary = Dictionary::from_bytes(bytes).expect("sound");
        let level = Level::from_cells(&[[0, 0, 0]], Vec3::ONE).expect("one cell");
        let config = AssembleConfig::default();
        let scene = Scene::assemble(&level, &dictionary, &config).expect("a closed cell");
        let mut list = LightList::new();
        let lamp = Light::sphere(Vec3::splat(0.5), 0.1, Vec3::ONE);
        let lamps = vec![lamp; MAX_LIGHTS + 2];
        list.replace(&scene.level, &lamps);
        let ids: Vec<LightId> = list.ids().collect();
        assert_eq!(list.skipped, 2);
        assert_eq!(list.remove(&scene.level, ids[7]), Some(lamp));
        assert_eq!(list.skipped, 1);
        assert_eq!(list.remove(&scene.level, ids[MAX_LIGHTS + 1]), Some(lamp));
        assert_eq!(list.skipped, 0);
        assert_eq!(list.placed().len(), MAX_LIGHTS);
        let one_more = list.add(&scene.level, lamp);
        assert_eq!((list.skipped, list.get(one_more)), (1, Some(lamp)));
        list.replace(&scene.level, &[lamp]);
        assert_eq!((list.skipped, list.ids().count()), (0, 1));
        assert_eq!(list.get(ids[3]), None);
    }
}
