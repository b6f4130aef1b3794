"""What the robot says of itself: the bodies of its packets.

Must not know: when they are sent, framing.
"""

from slam.dmath import DEGREE, PI
from slam.sweep import TURN
from sonarlog.protocol.fields import Value
from sonarlog.protocol.packets import MOTORS, MOVING, SONAR, STOPPED, ConfigPacket, SimStat, Sip
from sonarlog.robot import Robot
from sonarlog.sim.body import Body
from sonarlog.sim.drive import ACCELERATION_MM_S2, HALF_TRACK_MM, MAX_TURN_DEG_S, TURN_ACCELERATION_DEG_S2, Drive
from sonarlog.sim.sonars import Sonars

WATCHDOG_NS = 2_000_000_000

_BOTH_WHEELS = 0x0101
_FULL, _EMPTY, _DECIVOLT_NS = 130, 110, 600_000_000_000  # battery in 0.1 V, and how long one of them lasts
_NO_THERMOMETER = -127
_ENCODER_TICKS_A_MM = 30


def sip(robot: Robot, body: Body, drive: Drive, sonars: Sonars, now_ns: int) -> bytes:
    """The standard packet, with all the readings that are new. Battery falls by 0.1 V in ten minutes."""
    half = robot.heading_units_per_turn // 2
    heading = round(body.odometry_heading / (2.0 * PI) * robot.heading_units_per_turn)
    left, right = (round(v / robot.velocity_mm_s_per_unit) for v in drive.wheels_mm_s)
    battery = max(_EMPTY, _FULL - now_ns // _DECIVOLT_NS)
    arrays = SONAR & (2 << sonars.arrays) - 2 if sonars.on else 0
    return Sip(
        x=round(body.odometry_x * 1000 / robot.mm_per_unit) & 0x7FFF,
        y=round(body.odometry_y * 1000 / robot.mm_per_unit) & 0x7FFF,
        heading=(heading + half) % (2 * half) - half,
        left=left,
        right=right,
        battery=battery,
        stall_bumps=_BOTH_WHEELS if body.stalled else 0,
        flags=(MOTORS if drive.enabled else 0) | arrays,
        sonar=sonars.take(),
        tail=_tail(battery, round(drive.turn / DEGREE * 10)),
        type=MOVING if drive.moving else STOPPED,
    ).encode()


def _tail(battery: int, turn_rate: int) -> tuple[int, ...]:
    """Sip.TAIL up to where MobileSim ends it: no gripper, ports open, not charging."""
    return 0, 0, 0, 0xFF, 0xFF, battery, 0, turn_rate, 0, 0, _NO_THERMOMETER, 0


def config(robot: Robot) -> bytes:
    """CONFIGpac: the fields a client looks at, the others 0, like those of a robot without the part in question."""
    values: dict[str, Value] = {
        "type": "Pioneer",
        "subtype": robot.name,
        "serial": "SIM",
        "rotveltop": robot.max_turn_deg_s,
        "transveltop": robot.max_velocity_mm_s,
        "rotacctop": robot.max_turn_deg_s,
        "transacctop": 2000,
        "pwmmax": 400,
        "name": "sonarlog-sim",
        "sip_cycle_ms": robot.sip_cycle_ms,
        "front_sonar": 1,
        "rear_sonar": int(len(robot.sonars) > 8),
        "watchdog_ms": WATCHDOG_NS // 1_000_000,
        "stallval": 150,
        "rotvelmax": MAX_TURN_DEG_S,
        "transvelmax": robot.max_velocity_mm_s,
        "rotacc": TURN_ACCELERATION_DEG_S2,
        "rotdecel": TURN_ACCELERATION_DEG_S2,
        "transacc": ACCELERATION_MM_S2,
        "transdecel": ACCELERATION_MM_S2,
        "sonar_cycle_ms": robot.sonar_cycle_ms,
        "autobaud": 2,
        "ticks_mm": _ENCODER_TICKS_A_MM,
        "version": "S.0",
    }
    fields = tuple(values.get(name, "" if kind == "str" else 0) for name, kind in ConfigPacket.LAYOUT)
    return ConfigPacket(fields).encode()


def sim_stat(body: Body) -> bytes:
    """Where the robot truly is, rounded as the protocol has it, and exactly."""
    x_um, y_um, heading = body.true_pose
    return SimStat(
        round(x_um / 1000), round(y_um / 1000), 0, round(heading * 360 / TURN), (x_um, y_um, heading)
    ).encode()


def encoders(body: Body) -> bytes:
    """ENCODERpac: ticks of the left and the right wheel since the robot was built."""
    across = body.turned * HALF_TRACK_MM
    ticks = (round((body.travel * 1000 + side * across) * _ENCODER_TICKS_A_MM) for side in (-1, 1))
    return bytes((0x90,)) + b"".join((count & 0xFFFFFFFF).to_bytes(4, "little") for count in ticks)
