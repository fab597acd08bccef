"""Draw the triangles of imgui's widgets with moderngl.

moderngl-window's own integration lacks the textures API of imgui-bundle 1.92.
"""

import ctypes

import moderngl
import numpy as np

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.walk.native_imgui import imgui

_VERTEX_LAYOUT = "2f 2f 4f1"
_BLEND = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA


class ImguiRenderer:
    """Draw imgui's draw lists, and hold the textures that imgui requests.

    Parameters
    ----------
    device
        The GPU that draws.
    """

    def __init__(self, device: Device) -> None:
        self.gl = device.scope("imgui")
        self._program = Program(self.gl, "imgui/imgui.vert", "imgui/imgui.frag")
        self._textures: dict[int, moderngl.Texture] = {}
        self._owned: set[int] = set()
        self._vertices, self._indices = (self.gl.buffer(reserve=4, dynamic=True) for _ in range(2))
        content = [(self._vertices, _VERTEX_LAYOUT, "in_position", "in_uv", "in_colour")]
        self._array = self.gl.vertex_array(
            self._program.gl, content, index_buffer=self._indices, index_element_size=imgui.INDEX_SIZE
        )
        imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures

    def show(self, texture: moderngl.Texture) -> imgui.ImTextureRef:
        """Return the reference by which `imgui.image` shows `texture`; it is valid until the texture is released."""
        self._textures[texture.glo] = texture
        return imgui.ImTextureRef(texture.glo)

    def draw(self, data: imgui.ImDrawData, screen: moderngl.Framebuffer) -> None:
        """Draw a frame of imgui over a picture.

        Parameters
        ----------
        data
            The result of `imgui.get_draw_data` after `imgui.render`.
        screen
            The framebuffer to draw over; afterwards it has no scissor rectangle.
        """
        for texture in imgui.get_platform_io().textures:
            self._serve(texture)
        scale = data.framebuffer_scale
        height = round(data.display_size.y * scale.y)
        self._program.set(image=0, display_size=(data.display_size.x, data.display_size.y))
        with self.gl.state(into=screen, blend=_BLEND):
            for commands in data.cmd_lists:
                self._upload(commands)
                for command in commands.cmd_buffer:
                    box = command.clip_rect
                    left, top = max(0, int(box.x * scale.x)), max(0, int(box.y * scale.y))
                    right, bottom = int(box.z * scale.x), int(box.w * scale.y)
                    if right <= left or bottom <= top or not command.elem_count:
                        continue
                    screen.scissor = left, height - bottom, right - left, bottom - top
                    self._textures[command.tex_ref.get_tex_id()].use(0)
                    self._array.render(moderngl.TRIANGLES, vertices=command.elem_count, first=command.idx_offset)
            screen.scissor = None  # type: ignore[assignment]  # moderngl's "no scissor", missing from its stubs

    def release(self) -> None:
        """Free textures, buffers and program; imgui's context must still exist."""
        for texture in imgui.get_platform_io().textures:
            if texture.tex_id in self._owned:
                self._destroy(texture)
        self.gl.release()

    def _serve(self, texture: imgui.ImTextureData) -> None:
        """Create, update or destroy a texture of imgui (the glyphs of its font), as its status requires."""
        status = texture.status
        if status == imgui.ImTextureStatus.want_create:
            made = self.gl.texture((texture.width, texture.height), 4, data=texture.get_pixels_array().tobytes())
            made.filter = moderngl.LINEAR, moderngl.LINEAR
            self._textures[made.glo] = made
            self._owned.add(made.glo)
            texture.set_tex_id(made.glo)
            texture.status = imgui.ImTextureStatus.ok
        elif status == imgui.ImTextureStatus.want_updates:
            pixels = texture.get_pixels_array().reshape(texture.height, texture.width, 4)
            for part in texture.updates:
                block = np.ascontiguousarray(pixels[part.y : part.y + part.h, part.x : part.x + part.w])
                self._textures[texture.tex_id].write(block, viewport=(part.x, part.y, part.w, part.h))
            texture.status = imgui.ImTextureStatus.ok
        elif status == imgui.ImTextureStatus.want_destroy and texture.unused_frames > 0:
            self._destroy(texture)

    def _destroy(self, texture: imgui.ImTextureData) -> None:
        self._owned.discard(texture.tex_id)
        self.gl.free(self._textures.pop(texture.tex_id))
        texture.set_tex_id(0)
        texture.status = imgui.ImTextureStatus.destroyed

    def _upload(self, commands: imgui.ImDrawList) -> None:
        for buffer, source, stride in (
            (self._vertices, commands.vtx_buffer, imgui.VERTEX_SIZE),
            (self._indices, commands.idx_buffer, imgui.INDEX_SIZE),
        ):
            content = ctypes.string_at(source.data_address(), source.size() * stride) if source.size() else b""
            self.gl.refill(buffer, np.frombuffer(content, np.uint8))
