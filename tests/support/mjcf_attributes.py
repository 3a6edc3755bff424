"""MJCF files with one attribute each that moves bodies in MuJoCo: those that are taken here, and those that are named as not read."""

GRAVITY = 'gravity="0.3 0.2 -9.81"'
WORLD = """<mujoco><compiler angle="radian"/><option {gravity} {option}><flag {flag}/></option>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody><site name="hook" pos="0 .3 2"/>{world}
  <body name="a" {body}><joint name="j" axis="0 1 0" damping=".5" stiffness="2" {joint}/>
    <geom type="capsule" fromto="0 0 0 1 0 .1" size=".05" mass="1" {geom}/><geom type="box" size=".1 .2 .05" pos=".2 .1 0" density="300"/>
    <body name="tip" pos="1 0 .1" quat=".9 .1 .2 .3" {welded}><geom type="box" size=".03 .06 .1" mass=".3"/>
      <site name="eye" pos="0 0 .1"/></body>
    <body name="b" pos=".9 .1 0" euler=".1 .2 .3" {inner}><joint name="k" type="{kind}" axis="1 0 1" pos="0 .1 0" {second}/>
      <geom type="box" size=".1 .15 .3" pos="0 0 .3" density="400" {end}/></body></body>
  <body name="f" pos="0 2 0" quat=".8 0 .6 0" {flying}><freejoint name="root"/>
    <geom type="box" size=".1 .2 .3" pos=".1 0 .05" density="200"/>
    <body name="pack" pos=".1 .2 .4" euler=".3 .2 .1" {pack}><geom type="box" size=".1 .1 .2" pos=".1 0 0" density="100"/></body></body>
</worldbody>{rest}</mujoco>"""
PLAIN = dict(
    gravity=GRAVITY,
    option="",
    flag="",
    world="",
    body="",
    joint="",
    geom="",
    welded="",
    inner="",
    end="",
    flying="",
    pack="",
    kind="hinge",
    second="",
    rest="",
)


def fixed_tendon(attributes):
    return f'<tendon><fixed name="cable" {attributes}><joint joint="j" coef="1.5"/><joint joint="k" coef="-1"/></fixed></tendon>'


def actuators(*each):
    return f"<actuator>{''.join(each)}</actuator>"


SERVO = '<position joint="j" kp="3" kv=".2"/>'
MOVED = {  # what acts, and is in the model or offered
    "plain": {},
    "no gravity": {"gravity": 'gravity="0 0 0"'},
    "armature": {"joint": 'armature=".3"'},
    "spring reference": {"joint": 'springref=".4" ref=".1"'},
    "compensation": {"body": 'gravcomp="1"'},
    "more than compensation": {"body": 'gravcomp="1.4"'},
    "compensation of two bodies": {"body": 'gravcomp=".6"', "inner": 'gravcomp="-.3"'},
    "compensation of what flies and carries": {"flying": 'gravcomp=".4"', "pack": 'gravcomp="1"'},
    "geoms of a parent and its child": {"geom": 'contype="1" conaffinity="1"', "end": 'contype="1" conaffinity="1"'},
    "lifted down": {"body": 'gravcomp="-.5"'},
    "compensation of a welded part": {"welded": 'gravcomp=".7"', "body": 'gravcomp="1"'},
    "density": {"option": 'density="20"'},
    "viscosity": {"option": 'viscosity=".4"'},
    "wind": {"option": 'density="3" viscosity=".1" wind="3 -2 1"'},
    "wind alone": {"option": 'wind="3 -2 1"'},
    "quadratic damping": {"joint": 'damping=".5 .3"', "_replaces": "joint"},
    "ball": {"kind": "ball", "second": 'stiffness="1.5" damping=".3" armature=".05"'},
    "slide": {"kind": "slide", "second": 'stiffness="1.5" damping=".3" springref=".2"'},
    "a motor": {"rest": actuators('<motor joint="k" gear="3"/>')},
    "a servo": {"rest": actuators(SERVO)},
    "a servo with gear": {"rest": actuators('<general joint="k" gear="-3" gainprm="2" biastype="affine" biasprm=".4 -2 -.3"/>')},
    "a velocity servo": {"rest": actuators('<velocity joint="j" kv="2"/>')},
    "in the parent": {"rest": actuators('<position jointinparent="k" kp="3"/>')},
    "a control above zero": {"rest": actuators('<motor joint="j" ctrllimited="true" ctrlrange="1 2" gear="2"/>')},
    "an unlimited control": {"flag": 'clampctrl="disable"', "rest": actuators('<motor joint="j" ctrllimited="true" ctrlrange="1 2"/>')},
    "a servo at its limit": {"rest": actuators('<position joint="j" kp="30" forcelimited="true" forcerange="-.5 .5"/>')},
    "a limit of a joint": {
        "joint": 'actuatorfrclimited="true" actuatorfrcrange="-.4 .4"',
        "rest": actuators('<position joint="j" kp="30" gear="2"/>'),
    },
    "rotor and damping of an actuator": {"rest": actuators('<motor joint="j" gear="2" armature=".1" damping=".3"/>')},
    "actuation disabled": {"flag": 'actuation="disable"', "rest": actuators(SERVO, '<motor joint="k" armature=".1" damping=".3"/>')},
    "a group disabled": {"option": 'actuatorgroupdisable="1 3"', "rest": actuators(SERVO.replace("/>", ' group="3"/>'))},
    "gravity disabled": {"flag": 'gravity="disable"'},
    "compensation without gravity": {"flag": 'gravity="disable"', "body": 'gravcomp="1"'},
    "springs disabled": {"flag": 'spring="disable"', "body": 'gravcomp="1"'},
    "dampers disabled": {"flag": 'damper="disable"', "option": 'density="20"', "rest": actuators('<motor joint="j" damping=".3"/>')},
    "no passive forces": {"flag": 'spring="disable" damper="disable"', "option": 'density="20"', "body": 'gravcomp="1"'},
    "friction disabled": {"flag": 'frictionloss="disable"', "joint": 'frictionloss=".4"'},
    "constraints disabled": {"flag": 'constraint="disable"', "joint": 'frictionloss=".4" limited="true" range="-.1 .1"'},
    "limits disabled": {"flag": 'limit="disable"', "joint": 'limited="true" range="-.1 .1"'},
    "equalities disabled": {"flag": 'equality="disable"', "rest": '<equality><joint joint1="j" joint2="k"/></equality>'},
    "an equality that is not active": {"rest": '<equality><connect body1="a" body2="f" anchor="0 0 0" active="false"/></equality>'},
    "contacts disabled": {
        "flag": 'contact="disable"',
        "geom": 'contype="1" conaffinity="1"',
        "world": '<geom size="1" contype="1" conaffinity="1"/>',
    },
    "compensation by actuators": {
        "body": 'gravcomp="1"',
        "joint": 'actuatorgravcomp="true"',
        "second": 'actuatorgravcomp="true"',
        "rest": actuators(SERVO),
    },
    "magnetic field": {"option": 'magnetic="1 2 3"'},
    "sensors": {"rest": '<sensor><jointpos joint="j"/></sensor>'},
    "a tendon that does nothing": {"rest": fixed_tendon("")},
    "a tendon without springs": {"rest": fixed_tendon('stiffness="3"'), "flag": 'spring="disable"'},
}
NAMED = {  # what acts, and is named
    "a stiff tendon": ({"rest": fixed_tendon('stiffness="3" springlength="0"')}, "tendon 'cable' (stiffness)"),
    "a damped tendon": ({"rest": fixed_tendon('damping="3"')}, "tendon 'cable' (damping)"),
    "a heavy tendon": ({"rest": fixed_tendon('armature="3"')}, "tendon 'cable' (armature)"),
    "a rubbing tendon": ({"rest": fixed_tendon('frictionloss="3"')}, "tendon 'cable' (frictionloss)"),
    "a limited tendon": ({"rest": fixed_tendon('limited="true" range="-.1 .1"')}, "tendon 'cable' (limits)"),
    "a wrapped tendon": (
        {"rest": '<tendon><spatial name="rope" stiffness="3" springlength="0"><site site="hook"/><site site="eye"/></spatial></tendon>'},
        "tendon 'rope' (stiffness)",
    ),
    "an actuator of a tendon": ({"rest": fixed_tendon("") + actuators('<position tendon="cable" kp="3"/>')}, "it does not act on a joint"),
    "a rotor of a tendon": (
        {"rest": fixed_tendon("") + actuators('<motor tendon="cable" armature=".2"/>')},
        "tendon 'cable' (its actuator's armature or damping)",
    ),
    "cubic damping": ({"joint": 'damping=".5 .1 .2"', "_replaces": "joint"}, "the cubic damping of joint 'j'"),
    "polynomial damping of an actuator": (
        {"rest": actuators('<motor joint="j" damping="0 .2 0"/>')},
        "the polynomial damping of actuators of joint 'j'",
    ),
    "polynomial stiffness": ({"joint": 'stiffness="2 1"', "_replaces": "joint"}, "the quadratic and cubic stiffness of joint 'j'"),
    "plastic spring": ({"joint": 'springyield=".05"'}, "the plastic yield of joint 'j'"),
    "limits": ({"joint": 'limited="true" range="-.1 .1" margin="4"'}, "stops at the limits of joint 'j'"),
    "contacts": (
        {"geom": 'contype="1" conaffinity="1"', "world": '<geom size=".6" pos=".5 0 0" contype="1" conaffinity="1"/>'},
        "contacts (7 geoms)",
    ),
    "geoms of a parent and its child that touch": (
        {"geom": 'contype="1" conaffinity="1"', "end": 'contype="1" conaffinity="1"', "flag": 'filterparent="disable"'},
        "contacts (6 geoms)",
    ),
    "a pair": (
        {"geom": 'name="g"', "world": '<geom name="w" size=".6" pos=".5 0 0"/>', "rest": '<contact><pair geom1="g" geom2="w"/></contact>'},
        "contacts (7 geoms, 1 pair)",
    ),
    "ellipsoids in a fluid": ({"option": 'density="20"', "geom": 'fluidshape="ellipsoid"'}, "forces of the fluid on ellipsoids of 'a'"),
    "a muscle": ({"rest": actuators('<muscle joint="j" force="3" lengthrange="-1 1"/>')}, "it has a state of its own"),
    "a damper": ({"rest": actuators('<damper joint="j" kv="2" ctrlrange="1 2"/>')}, "its force is not affine"),
    "an asymmetric servo": (
        {"rest": actuators('<position joint="j" kp="30" forcelimited="true" forcerange="-.2 .7"/>')},
        "force range [-0.2, 0.7] of actuator 'actuator0', which is not symmetric",
    ),
    "a shared limit": (
        {"joint": 'actuatorfrclimited="true" actuatorfrcrange="-.4 .4"', "rest": actuators(SERVO, SERVO)},
        "it shares a limit of force with other actuators at its joint",
    ),
    "a motor on a ball": (
        {"kind": "ball", "rest": actuators('<motor joint="k" gear="2 1 0" ctrllimited="true" ctrlrange="1 2"/>')},
        "its joint has several coordinates",
    ),
    "compensation within limits": (
        {
            "body": 'gravcomp="1"',
            "joint": 'actuatorgravcomp="true" actuatorfrclimited="true" actuatorfrcrange="-.2 .2"',
            "rest": actuators(SERVO),
        },
        "the limit of the total force of actuators at joint 'j'",
    ),
    "compensation at some joints": (
        {"inner": 'gravcomp="1"', "joint": 'actuatorgravcomp="true"'},
        "gravity compensation, which acts at some joints only",
    ),
    "an equality of tendons": (
        {"rest": fixed_tendon("") + '<equality><tendon tendon1="cable"/></equality>'},
        "equality tendon of 'cable'",
    ),
    "a rotor on a ball": (
        {"kind": "ball", "rest": actuators('<motor joint="k" gear="2 0 0" armature=".1" damping=".3"/>')},
        "its joint has several coordinates",
    ),
    "an orientation servo": ({"kind": "ball", "rest": actuators('<so3 joint="k" kp="3"/>')}, "it does not act on a joint"),
}


def text_of(parts):
    values = {key: " ".join(filter(None, (PLAIN[key], parts.get(key, "")))) for key in PLAIN} | {"kind": parts.get("kind", "hinge")}
    values["gravity"] = parts.get("gravity", GRAVITY)
    text = WORLD.replace(' damping=".5" stiffness="2" {joint}', " {joint}") if parts.get("_replaces") else WORLD
    return text.format(**values)
