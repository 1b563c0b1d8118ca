"""iccm in Blender's UV editor: fit islands into outlines, map textures onto faces, transfer textures to another layout.

Each operator writes meshes and pictures into a temporary folder, runs `iccm` there as a process, and reads the results.
Blender stays responsive meanwhile, and Esc cancels. Without a window, as in scripts, the operator waits for the result.
"""

import tempfile
import time
from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from . import exchange
from .iccm_process import Failed, messages, python, start

FILES = {
    "islands.svg": "the selected islands",
    "islands.obj#uv": "the selected islands",
    "islands.obj": "the selected islands",
    "outline.obj#uv": "the active island",
    "outline.obj": "the active island",
    "outline.svg": "the outline",
    "canvas.svg": "the picture",
}
"""Names for files of the temporary folder in messages."""
EVERY = 0.2  # seconds between two checks of the process
FITS = [
    ("auto", "Automatic", "What fits best"),
    ("whole", "Whole Outlines", "Outline onto outline"),
    ("contain", "Show All", "No part of the source is hidden"),
    ("cover", "Cover All", "No part of the target stays bare"),
]


class Preferences(bpy.types.AddonPreferences):
    """The preferences of the add-on: the location of iccm."""

    bl_idname = __package__
    python: StringProperty(
        name="Python of iccm",
        description="The Python that iccm is installed in. Empty: the one recorded by `iccm plugins install blender`",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        """Draw the field for the path."""
        self.layout.prop(self, "python")


class Run:
    """Base class of operators that run iccm.

    Subclasses define `prepare`, which returns the commands, and `take`, which reads the results.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - required by Blender
    _asked = False

    @classmethod
    def poll(cls, context):
        """Return whether the active object is a mesh with texture coordinates; Blender shows what is missing."""
        found = context.object
        if found is None or found.type != "MESH":
            cls.poll_message_set("Select a mesh first")
        elif not found.data.uv_layers:
            cls.poll_message_set(
                f"{found.name} has no texture coordinates; unwrap it first (U in Edit Mode, or UV > Unwrap)"
            )
        else:
            return True
        return False

    def invoke(self, context, _event):
        """Show the options before running."""
        self._asked = True
        return context.window_manager.invoke_props_dialog(self, width=400)

    def waits(self):
        """Return whether to wait for the result.

        This is so without a window, and in the panel of the last operation (F9), which runs the operator again with
        other options.
        """
        return bpy.app.background or not self._asked

    def execute(self, context):
        """Start the first command; without a window, wait for the result."""
        self._folder = tempfile.TemporaryDirectory(prefix="iccm-")
        self._timer = None
        try:
            entry = context.preferences.addons.get(__package__)
            interpreter = bpy.path.abspath(entry.preferences.python) if entry else ""
            self._interpreter = interpreter or python("blender")
            self._log = str(Path(self._folder.name) / "messages")
            self._commands = iter(self.prepare(context, Path(self._folder.name)))
            self._next()
        except (Failed, exchange.Unfit, OSError, RuntimeError) as error:
            return self._failed(str(error))
        self._began = time.monotonic()
        if self.waits():
            while (done := self._advance(context)) is None:
                self._process.wait()
            return done
        self._timer = context.window_manager.event_timer_add(EVERY, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Check the process, or cancel it with Esc.

        Other events are consumed, so that the mesh does not change while iccm works on it.
        """
        if event.type == "ESC":
            self._process.kill()
            self._process.wait()
            self._close(context)
            self.report({"INFO"}, "iccm was cancelled; the scene is unchanged")
            return {"CANCELLED"}
        if event.type == "TIMER" and (done := self._advance(context)) is not None:
            return done
        context.workspace.status_text_set(
            f"iccm: {self.bl_label}, {time.monotonic() - self._began:.0f} s. Press Esc to cancel"
        )
        return {"RUNNING_MODAL"}

    def _next(self):
        """Start the next command, if there is one."""
        command = next(self._commands, None)
        if command is not None:
            command = [*command, "--log-format", "json", "-q"]
            self._process = start(self._interpreter, command, self._folder.name, self._log)
        return command

    def _advance(self, context):
        """Check the process and start the next command; return how the operator ended, or None if it is still
        running.
        """
        code = self._process.poll()
        if code is None:
            return None
        errors, doubts = messages(self._log)
        if code not in (0, 1):
            return self._failed(readable("\n".join(errors)) or f"iccm ended with exit code {code}", context)
        for line in [*errors, *doubts]:
            self.report({"WARNING"}, readable(line))
        try:
            if self._next() is not None:
                return None
            self.take(context, Path(self._folder.name))
        except (Failed, exchange.Unfit, OSError, RuntimeError) as error:
            return self._failed(str(error), context)
        self._close(context)
        return {"FINISHED"}

    def _failed(self, message, context=None):
        self._close(context)
        self.report({"ERROR"}, message)
        return {"CANCELLED"}

    def _close(self, context):
        if self._timer is not None and context is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.workspace.status_text_set(None)
        self._folder.cleanup()


def readable(text):
    """Return a message with names from the scene in place of temporary file names."""
    for name, title in FILES.items():
        text = text.replace(name, title)
    return text


def existing(path):
    """Return the absolute path of a file that the user entered; it may end in #id.

    Raises:
        Unfit: the path is empty, or there is no such file.
    """
    path = bpy.path.abspath(path)
    if not path:
        raise exchange.Unfit("choose the file of the outline")
    if Path(path).is_dir():
        raise exchange.Unfit(f"{path} is a folder; choose a file in it")
    if not any(Path(each).is_file() for each in (path, path.rpartition("#")[0])):
        raise exchange.Unfit(f"{path}: there is no such file")
    return path


def shares_outline(parts, mesh, faces):
    """Return whether several islands are fitted into the outline together."""
    return parts == "joined" and mesh.count(faces) > 1


def onto_islands(source, mesh, faces, turn):
    """Return the command that maps a shape onto each island of a layout, with the rotation that the user entered."""
    parts = ["--parts", "each"] if mesh.count(faces) > 1 else []
    turned = [f"--turn={turn.strip()}"] if turn.strip() else []
    return ["map", source, "islands.obj#uv", *parts, *turned]


class ICCM_OT_fit_island(Run, bpy.types.Operator):
    """Fit the selected UV islands into an outline, evenly and without folds"""

    bl_idname = "iccm.fit_island"
    bl_label = "Fit Island into Outline"
    outline: EnumProperty(
        name="Outline",
        items=[
            (
                "island",
                "Active Island",
                "The island of the active face; the other selected islands are fitted into it",
            ),
            ("file", "SVG or Picture", "The largest shape of a file whose canvas is the unit square"),
            ("curve", "Curve Object", "A curve, seen from above, scaled to the unit square"),
        ],
    )
    filepath: StringProperty(name="File", subtype="FILE_PATH", description="file.svg or file.svg#id")
    curve: StringProperty(name="Curve")
    parts: EnumProperty(
        name="Several Islands",
        items=[
            ("joined", "Side by Side", "All islands share the outline, arranged and sized as in the UV map"),
            ("each", "On Top of Each Other", "Each island fills the outline"),
        ],
    )
    fit: EnumProperty(name="Fit", items=FITS, default="whole")
    turn: StringProperty(
        name="Rotation", description="Degrees counter-clockwise, or any; empty: keep the island's orientation"
    )
    balance: FloatProperty(
        name="Balance",
        default=1,
        min=0,
        max=10,
        description="0 keeps angles, 1 weights both equally, more keeps areas",
    )

    def draw(self, context):
        """Draw the field for the chosen kind of outline, and the fitting options."""
        self.layout.prop(self, "outline")
        if self.outline == "file":
            self.layout.prop(self, "filepath")
        elif self.outline == "curve":
            self.layout.prop_search(self, "curve", context.scene, "objects")
        for name in ("parts", "fit", "turn", "balance"):
            self.layout.prop(self, name)

    def prepare(self, context, folder):
        """Write the islands and the outline to files; return the commands."""
        mesh = exchange.Layout(context.object, context.tool_settings.use_uv_select_sync)
        faces = mesh.islands_of(mesh.selected)
        if self.outline == "island":
            if mesh.active is None:
                raise exchange.Unfit(
                    "no face is active: in Edit Mode, click a face of the island to fit the others into"
                )
            onto = mesh.islands_of([mesh.active])
            faces = [face for face in faces if face not in set(onto)]
            if not faces:
                raise exchange.Unfit(
                    "select the islands to fit and, last, a face of the island to fit them into"
                )
            if shares_outline(self.parts, mesh, faces):
                mesh.write_islands(folder / "outline.svg", onto)
                outline = "outline.svg"
            else:
                mesh.write(folder / "outline.obj", onto, mesh.mirrored())
                outline = "outline.obj#uv"
        elif self.outline == "file":
            outline = existing(self.filepath)
        else:
            exchange.write_curve(context, self.curve, folder / "outline.svg")
            outline = "outline.svg"
        if not faces:
            raise exchange.Unfit("select faces of the islands to fit")
        self._faces, self._layer, self._mirrored = faces, mesh.layer, mesh.mirrored()
        if shares_outline(self.parts, mesh, faces):
            mesh.write_islands(folder / "islands.svg", faces)
            mesh.write_corners(folder / "corners.csv", faces)
            turned = [f"--turn={self.turn.strip()}"] if self.turn.strip() else []
            # Whole outlines, the default for one island, would be one frame around all islands. The best of several
            # frames is chosen instead.
            fit = ["--fit", self.fit] if self.fit != "whole" else []
            # The islands are shapes, not a picture, so their outlines are mapped onto that of the target.
            how = ["--detail", "0", "--parts", "joined", *fit, *turned, "--balance", f"{self.balance:g}"]
            return [
                ["map", "islands.svg", outline, *how, "-o", "map.npz"],
                ["apply", "map.npz", "corners.csv", "--unmapped", "keep", "-o", "placed.csv"],
            ]
        mesh.write(folder / "islands.obj", faces, self._mirrored)
        fit = ["--fit", self.fit, "--balance", f"{self.balance:g}"]
        return [[*onto_islands(outline, mesh, faces, self.turn), *fit, "-o", "fitted.obj"]]

    def take(self, context, folder):
        """Set the islands' new coordinates."""
        if (folder / "placed.csv").is_file():
            exchange.set_corners(context.object, self._layer, self._faces, folder)
            return
        made = folder / "fitted.obj"
        exchange.set_coordinates(context.object, self._layer, self._faces, self._mirrored, made)


class ICCM_OT_transfer(Run, bpy.types.Operator):
    """Map a picture onto the islands of the selected faces, over the picture in the editor"""

    bl_idname = "iccm.transfer"
    bl_label = "Transfer Texture onto Selected Faces"
    picture: StringProperty(name="Picture", description="A picture of this .blend file")
    source: EnumProperty(
        name="Its Shape",
        items=[
            ("canvas", "All of the Picture", "Its rectangle"),
            ("shape", "Visible Shape", "The outline of its opaque part, or of the part that stands out"),
            ("file", "SVG", "The largest shape of a drawing with the same canvas"),
        ],
    )
    filepath: StringProperty(name="File", subtype="FILE_PATH", description="file.svg or file.svg#id")
    fit: EnumProperty(name="Fit", items=FITS)
    turn: StringProperty(name="Rotation", description="Degrees counter-clockwise, or any")
    size: IntProperty(
        name="Size", default=1024, min=16, max=16384, description="Pixels, if the editor shows no picture"
    )

    def draw(self, context):
        """Draw the fields for the picture and its shape, and the fitting options."""
        self.layout.prop_search(self, "picture", bpy.data, "images")
        self.layout.prop(self, "source")
        if self.source == "file":
            self.layout.prop(self, "filepath")
        for name in ("fit", "turn", "size"):
            self.layout.prop(self, name)

    def prepare(self, context, folder):
        """Write the islands, the picture and its shape to files; return the commands."""
        mesh = exchange.Layout(context.object, context.tool_settings.use_uv_select_sync)
        faces = mesh.islands_of(mesh.selected)
        if not faces:
            raise exchange.Unfit("select faces of the islands to map the picture onto")
        image = bpy.data.images.get(self.picture)
        if image is None:
            raise exchange.Unfit("choose a picture")
        mesh.write(folder / "islands.obj", faces)
        texture = exchange.save(image, folder / "picture")
        self._under = exchange.shown_image(context, image)
        source = texture
        if self.source == "canvas":
            exchange.write_canvas(image, folder / "canvas.svg")
            source = "canvas.svg"
        elif self.source == "file":
            source = existing(self.filepath)
        width, height = self._under.size if self._under else (self.size, self.size)
        fit = ["--fit", self.fit] if self.fit != "auto" else []
        made = ["--texture", texture, "--size", f"{width}x{height}", "--padding", "16", "-o", "layer.png"]
        return [[*onto_islands(source, mesh, faces, self.turn), *fit, *made]]

    def take(self, context, folder):
        """Add a new picture, and show it in the editor and in the material.

        The operator leaves Edit Mode first, because only in Object Mode does Undo include the picture and the material.
        """
        made = exchange.over(folder / "layer.png", self._under)
        exchange.leave_edit_mode(context)
        exchange.show(context, made, self._under)


class ICCM_OT_relayout(Run, bpy.types.Operator):
    """Transfer the materials' textures from the rendered UV map to the active one, and render with that one"""

    bl_idname = "iccm.relayout"
    bl_label = "Relayout Textures to the Active UV Map"
    size: IntProperty(
        name="Size", min=0, max=16384, description="Pixels; 0: same density on the surface as before"
    )

    def prepare(self, context, folder):
        """Write both layouts and the pictures to files; return a command for each group of materials with the same
        pictures.
        """
        owner = context.object
        layers = owner.data.uv_layers
        self._old, self._new = next(each.name for each in layers if each.active_render), layers.active.name
        if self._old == self._new:
            raise exchange.Unfit(
                f"{self._new} is already the rendered UV map; make the UV map active that should receive the textures"
            )
        self._made, commands = {}, []
        old, new = exchange.Layout(owner, layer=self._old), exchange.Layout(owner, layer=self._new)
        for group, (materials, pictures) in enumerate(exchange.pictures(owner, self._old).items()):
            faces = old.with_materials(materials)
            if not faces:
                continue
            old.write(folder / f"old-{group}.obj", faces)
            new.write(folder / f"new-{group}.obj", faces)
            command = ["relayout", f"old-{group}.obj", f"new-{group}.obj", "--match", "index"]
            command += ["--size", str(self.size)] if self.size else []
            outputs = []
            for image, kind in pictures.items():
                texture = exchange.save(image, folder / f"picture-{len(self._made)}")
                self._made[image] = f"new-{texture}"
                command += [f"--{kind}", texture]
                outputs += ["-o", self._made[image]]
            commands.append(command + outputs)
        if not commands:
            raise exchange.Unfit(f"no material of the faces uses a picture with the UV map {self._old}")
        return commands

    def take(self, context, folder):
        """Replace the old pictures by new ones, and make the active UV map the rendered one."""
        exchange.leave_edit_mode(context)
        made = {
            image: exchange.load(folder / name, f"{image.name} {self._new}", image)
            for image, name in self._made.items()
        }
        exchange.replace(context.object, made, self._old, self._new)


class ICCM_PT_texture(bpy.types.Panel):
    """The panel with the operators."""

    bl_label, bl_category = "Texture Transfer", "iccm"
    bl_space_type, bl_region_type = "IMAGE_EDITOR", "UI"

    def draw(self, _context):
        """Draw a button for each operator."""
        for each in OPERATORS:
            self.layout.operator(each.bl_idname)


OPERATORS = (ICCM_OT_fit_island, ICCM_OT_transfer, ICCM_OT_relayout)
CLASSES = (Preferences, *OPERATORS, ICCM_PT_texture)


def register():
    """Register the add-on; called by Blender when it is enabled."""
    for each in CLASSES:
        bpy.utils.register_class(each)


def unregister():
    """Remove the add-on; called by Blender when it is disabled."""
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
