"""The style sheets, which lay out the screens by the size of the terminal."""

# The screen has a class from this many columns or lines on.
WIDTHS = [(0, "-narrow"), (110, "-wide"), (150, "-full")]
HEIGHTS = [(0, "-low"), (36, "-tall")]

DRIVE = """
Screen { background: $background; overflow: hidden; }

SnapshotWidget { width: 1fr; height: 1fr; color: $foreground; }
#status, #notice, #keys, #timeline { height: 1; }
#timeline { display: none; }
#status, #keys { background: $surface; }

#body { layout: horizontal; height: 1fr; }
#left, #right { layout: vertical; height: 1fr; width: 1fr; }
#right { width: 46; }
#below { layout: horizontal; height: 7; }

#robot, #world, #path, #units, #behaviors, #attributes, #heat, #spectra {
    border: round $foreground 22%;
    border-title-color: $primary;
    border-title-style: bold;
    border-subtitle-color: $foreground 45%;
    padding: 0;
}
#behaviors, #attributes, #units { padding: 0 1; }
/* The behaviors take what they need of their part, and the attributes the rest. */
#behaviors { height: auto; max-height: 56%; }
#attributes { height: 1fr; }
.-bench #attributes { height: 8; }
#units, #world, #spectra { display: none; }
#heat { height: 3; border-bottom: none; border-left: none; border-right: none; padding: 0; }

/* Where there is little room, only while time stands still or a recording is watched. */
.-tall #timeline, .-timeline #timeline { display: block; }

#too-small { display: none; width: 1fr; height: 1fr; }
.-too-small #too-small { display: block; }
.-too-small #status, .-too-small #body, .-too-small #heat { display: none; }
.-too-small #notice, .-too-small #keys, .-too-small #timeline { display: none; }

.-wide #right { width: 60; }
.-full #right { width: 74; }
.-full #units { display: block; width: 46; }
.-tall #below { height: 2fr; }
.-tall #robot { height: 3fr; }
.-tall.-bench #attributes { height: 18; }
.-tall #heat { height: 6; }

#bench {
    display: none;
    height: 1fr;
    border: round $primary;
    border-title-color: $primary;
    border-subtitle-color: $foreground 45%;
}
#bench-entry {
    display: none;
    height: 1;
    border: none;
    padding: 0;
    background: $surface;
}
.-bench #bench { display: block; }
.-bench #behaviors { display: none; }

/* Without a robot to draw, the attributes take its room. */
.-bodiless #left { display: none; }
.-bodiless #right { width: 1fr; }
.-bodiless #attributes { height: 1fr; }
.-full.-bodiless #left { display: block; width: 46; }
.-bodiless #robot, .-bodiless #path { display: none; }
.-bodiless #below { height: 1fr; }

/* With pictures of its world, these take the robot's place. */
.-pictured #left { display: block; width: 1fr; }
.-pictured #world { display: block; height: 3fr; }
.-pictured #right { width: 46; }
.-wide.-pictured #right { width: 60; }
.-pictured #below { display: none; }
.-full.-pictured #below { display: block; height: 12; }
.-full.-pictured #units { width: 1fr; }

/* The spectrograms take the place of the path, and where there is little room, of the robot, too. */
.-spectra #left { display: block; width: 1fr; }
.-spectra #spectra { display: block; height: 3fr; }
.-spectra #below, .-low.-spectra #robot, .-low.-spectra #world { display: none; }
.-spectra #right { width: 46; }
.-wide.-spectra #right { width: 60; }

HelpScreen { align: center middle; background: $background 60%; }
#help {
    width: 76;
    max-width: 100%;
    height: auto;
    max-height: 100%;
    border: round $primary;
    border-title-color: $primary;
    border-title-style: bold;
    border-subtitle-color: $foreground 60%;
    background: $surface;
    padding: 0 2;
    scrollbar-size-vertical: 1;
    scrollbar-color: $primary 40%;
    scrollbar-background: $surface;
}
"""
