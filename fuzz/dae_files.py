"""Write small scenes as COLLADA files."""

import numpy as np

from fuzz.case import Files
from fuzz.small_scenes import Shape, Use, distinct, words_of


def dae(uses: list[Use], pictures: Files, *, up: str = "Y_UP", metre: float = 1.0) -> Files:
    """Return a COLLADA file with its pictures; places are those of its own axes and unit."""
    shapes, paints = distinct(uses)
    images = "".join(f'<image id="{name}"><init_from>{name}</init_from></image>' for name in pictures)
    effects, materials, geometries, nodes = "", "", "", ""
    for paint in paints:
        diffuse = f"<color>{words_of(paint.colour)} 1</color>"
        parameters = ""
        if paint.picture:
            parameters = (
                f'<newparam sid="f"><surface type="2D"><init_from>{paint.picture}</init_from></surface></newparam>'
                '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
            )
            diffuse = '<texture texture="s" texcoord="UV"/>'
        effects += (
            f'<effect id="{paint.name}-fx"><profile_COMMON>{parameters}<technique sid="t"><phong>'
            f"<emission><color>{words_of(paint.emission)} 1</color></emission><diffuse>{diffuse}</diffuse>"
            f"<specular><color>{words_of([paint.specular] * 3)} 1</color></specular>"
            f"<shininess><float>{paint.exponent}</float></shininess>"
            f"<transparency><float>{paint.opacity}</float></transparency></phong></technique></profile_COMMON></effect>"
        )
        materials += f'<material id="{paint.name}-m"><instance_effect url="#{paint.name}-fx"/></material>'
    for number, shape in enumerate(shapes):
        geometries += _dae_geometry(f"g{number}", shape)
    numbers = {id(shape): number for number, shape in enumerate(shapes)}
    for use in uses:
        turns = "".join(
            f"<rotate>{' '.join('1' if k == axis else '0' for k in range(3))} {use.turned[axis]}</rotate>"
            for axis in (2, 1, 0)
        )
        nodes += (
            f'<node name="{use.name}"><translate>{words_of(use.moved)}</translate>{turns}'
            f'<scale>{words_of(use.scaled)}</scale><instance_geometry url="#g{numbers[id(use.shape)]}"><bind_material>'
            f'<technique_common><instance_material symbol="a" target="#{use.paint.name}-m"/></technique_common>'
            "</bind_material></instance_geometry></node>"
        )
    text = (
        '<?xml version="1.0" encoding="utf-8"?>\n<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" '
        f'version="1.4.1"><asset><unit meter="{metre}"/><up_axis>{up}</up_axis></asset>\n'
        f"<library_images>{images}</library_images>\n<library_effects>{effects}</library_effects>\n"
        f"<library_materials>{materials}</library_materials>\n<library_geometries>{geometries}</library_geometries>\n"
        f'<library_visual_scenes><visual_scene id="v">{nodes}</visual_scene></library_visual_scenes>\n'
        '<scene><instance_visual_scene url="#v"/></scene></COLLADA>'
    )
    return {"scene.dae": text.replace("><", ">\n<").encode(), **pictures}


def _dae_geometry(name: str, shape: Shape) -> str:
    sources, inputs, columns = "", "", [shape.vertex]
    layers = [("POSITION", shape.positions, "XYZ")]
    layers += [("NORMAL", shape.normals, "XYZ")] if shape.normals is not None else []
    layers += [("TEXCOORD", shape.uv, "ST")] if shape.uv is not None else []
    layers += [("COLOR", shape.colours, "RGB")] if shape.colours is not None else []
    for semantic, values, parameters in layers:
        sources += (
            f'<source id="{name}-{semantic}"><float_array id="{name}-{semantic}-a" count="{values.size}">'
            f'{words_of(values)}</float_array><technique_common><accessor source="#{name}-{semantic}-a" '
            f'count="{len(values)}" stride="{values.shape[1]}">'
            + "".join(f'<param name="{each}" type="float"/>' for each in parameters)
            + "</accessor></technique_common></source>"
        )
        if semantic != "POSITION":
            inputs += f'<input semantic="{semantic}" source="#{name}-{semantic}" offset="{len(columns)}"/>'
            columns.append(np.arange(len(shape.vertex)))
    return (
        f'<geometry id="{name}"><mesh>{sources}<vertices id="{name}-v"><input semantic="POSITION" '
        f'source="#{name}-POSITION"/></vertices><polylist material="a" count="{len(shape.polygons)}">'
        f'<input semantic="VERTEX" source="#{name}-v" offset="0"/>{inputs}<vcount>{words_of(shape.sizes)}</vcount>'
        f"<p>{words_of(np.stack(columns, axis=1))}</p></polylist></mesh></geometry>"
    )


def skinned_dae() -> bytes:
    """Return a COLLADA file of a square, half of which a joint moves upward by two from where it is bound."""
    return b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polygons count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 3</p></polygons>
</mesh></geometry></library_geometries>
<library_controllers><controller id="c"><skin source="#g">
<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>
<source id="j"><Name_array id="ja" count="2">still up</Name_array></source>
<source id="i"><float_array id="ia" count="32">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
1 0 0 0 0 1 0 -1 0 0 1 0 0 0 0 1</float_array></source>
<source id="w"><float_array id="wa" count="2">1 0.5</float_array></source>
<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#i"/></joints>
<vertex_weights count="4"><input semantic="JOINT" source="#j" offset="0"/>
<input semantic="WEIGHT" source="#w" offset="1"/>
<vcount>1 1 1 2</vcount><v>0 0 0 0 1 0 0 1 1 1</v></vertex_weights></skin></controller></library_controllers>
<library_visual_scenes><visual_scene id="s">
<node id="root" sid="still" type="JOINT"><node sid="up" type="JOINT"><translate>0 3 0</translate></node></node>
<node><translate>9 9 9</translate><instance_controller url="#c"><skeleton>#root</skeleton></instance_controller></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
