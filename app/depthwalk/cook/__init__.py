"""Cook depth images: turn them into the arrays that the GPU reads; no GL and no viewer. `cook.cook` is the outline."""
