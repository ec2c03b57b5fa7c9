// Colours as in the package's pictures; the colour-blind can tell left from right too.

export const PALETTE = {
  background: "#eceae4",
  floor: "#f6f4ee",
  ground: "#ddd8cd",
  ink: "#2b2d34",
  faint: "#63646a",
  left: "#256eb2",
  right: "#d66825",
  path: "#5c5e66",
  command: "#168e68",
  axis: "#be265c",
  goal: "#dea81e",
  reference: "#8c6eb4",
  steel: "#c9ccd1",
  horizon: "#eff0ee",
  zenith: "#b9d2e4",
} as const;

export type Colour = keyof typeof PALETTE;
