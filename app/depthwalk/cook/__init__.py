"""Cook depth images to the arrays that the GPU reads, without GL or a viewer. Start reading at `cook.cook`."""
