//! The lights of a frame, by ids that stay when others are removed.

use crate::level::placed::PlacedLevel;
use crate::light::limits::MAX_LIGHTS;
use crate::light::placed::{PlacedLight, place};
use crate::light::source::{Light, LightError};
use std::fmt;

/// A light of a frame. It stays the same until the light is removed; ids of removed lights name no light ever after.
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

/// A light that a frame left out, and why.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("light {id}: {reason}")]
pub struct SkippedLight {
    /// Which light.
    pub id: LightId,
    /// Why.
    pub reason: LightError,
}

/// Lights in slots. A slot that is free, or whose light is skipped, is off.
#[derive(Debug, Default)]
pub(super) struct LightList {
    slots: Vec<Slot>,
    free: Vec<u32>,
    /// By slot, of the first [`MAX_LIGHTS`].
    placed: Vec<PlacedLight>,
    skipped: usize,
}

#[derive(Debug)]
struct Slot {
    generation: u32,
    light: Option<Light>,
    error: Option<LightError>,
}

impl LightList {
    pub(super) fn new() -> Self {
        Self {
            placed: Vec::with_capacity(MAX_LIGHTS),
            ..Self::default()
        }
    }

    /// By slot: lights to shine, and lights that are off.
    pub(super) fn placed(&self) -> &[PlacedLight] {
        &self.placed
    }

    pub(super) fn add(&mut self, level: &PlacedLevel, light: Light) -> LightId {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(Slot {
                generation: 0,
                light: None,
                error: None,
            });
            if self.placed.len() < MAX_LIGHTS {
                self.placed.push(PlacedLight::OFF);
            }
            self.slots.len() as u32 - 1
        });
        self.put(level, slot, Some(light));
        self.id(slot)
    }

    /// False if there is no such light any more.
    pub(super) fn set(&mut self, level: &PlacedLevel, id: LightId, light: Light) -> bool {
        let exists = self.get(id).is_some();
        if exists {
            self.put(level, id.slot, Some(light));
        }
        exists
    }

    /// The light that was removed, if there was one.
    pub(super) fn remove(&mut self, level: &PlacedLevel, id: LightId) -> Option<Light> {
        let light = self.get(id)?;
        self.put(level, id.slot, None);
        self.slots[id.slot as usize].generation += 1;
        self.free.push(id.slot);
        Some(light)
    }

    pub(super) fn get(&self, id: LightId) -> Option<Light> {
        let slot = self.slots.get(id.slot as usize)?;
        slot.light.filter(|_| slot.generation == id.generation)
    }

    /// Replaces all lights: the k-th takes the k-th slot.
    pub(super) fn replace(&mut self, level: &PlacedLevel, lights: &[Light]) {
        for slot in 0..self.slots.len() as u32 {
            self.put(level, slot, None);
            self.slots[slot as usize].generation += 1;
        }
        self.free.clear();
        self.free.extend((0..self.slots.len() as u32).rev());
        for &light in lights {
            self.add(level, light);
        }
    }

    /// Finds the blocks of all lights anew, in another level.
    pub(super) fn place_in(&mut self, level: &PlacedLevel) {
        for slot in 0..self.slots.len() {
            self.put(level, slot as u32, self.slots[slot].light);
        }
    }

    /// Ids of all lights, by slot.
    pub(super) fn ids(&self) -> impl Iterator<Item = LightId> + '_ {
        let slots = (0..).zip(&self.slots);
        let taken = slots.filter(|(_, slot)| slot.light.is_some());
        taken.map(|(slot, _)| self.id(slot))
    }

    /// Appends the lights that are left out.
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

    fn put(&mut self, level: &PlacedLevel, slot: u32, light: Option<Light>) {
        let at = &mut self.slots[slot as usize];
        let placed = self.placed.get_mut(slot as usize);
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
