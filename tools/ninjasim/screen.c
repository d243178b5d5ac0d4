#include "screen.h"

#include <math.h>
#include <ncurses.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEL 0x7f
#define BACKSPACE 0x08

/* Rows, from the top; without the drawings what is below them moves up. */
enum {
    TITLE_ROW,
    DIAL_TITLE_ROW,
    DIAL_ROW,
    RADIUS = 6, /* of a dial in rows; a row is as high as two columns are wide */
    BELOW_DIALS = DIAL_ROW + 2 * RADIUS + 1,
    LINES_BELOW = 9,
    ROWS_WITH_DIALS = BELOW_DIALS + LINES_BELOW,
    COLUMNS_WITH_DIALS = 72,
    AZIMUTH_COLUMN = 18,
    ALTITUDE_COLUMN = 50,
    RIM_DEGREES = 5,
};

static const char axis_letter[HEAD_AXES] = {'X', 'Y'};

bool screen_open(void)
{
    SCREEN *screen = newterm(NULL, stdout, stdin);

    if (screen == NULL) {
        fprintf(stderr, "ninjasim: this terminal cannot be drawn on; --script or a pipe needs none\n");
        return false;
    }
    raw(); /* every key is a byte, Ctrl-C too */
    noecho();
    nonl();
    keypad(stdscr, TRUE);
    nodelay(stdscr, TRUE);
    set_escdelay(25);
    curs_set(0);
    atexit(screen_close);
    return true;
}

void screen_close(void)
{
    if (!isendwin()) {
        endwin();
    }
}

int screen_key(void)
{
    for (;;) {
        int key = getch();

        if (key == KEY_BACKSPACE || key == DEL) {
            return BACKSPACE;
        }
        if (key <= 0xff) { /* ERR, -1, too */
            return key == ERR ? -1 : key;
        }
    }
}

/* -- drawings ------------------------------------------------------------------------------------------------------- */

typedef struct {
    int row, column; /* of the middle */
    bool from_above; /* 0 is up and positive to the right; else 0 is to the right and positive up */
} dial_t;

static void dial_put(const dial_t *d, double degrees, double radius, char what)
{
    double angle = (d->from_above ? 90 - degrees : degrees) * M_PI / 180;

    mvaddch(d->row - (int)lround(radius * sin(angle)), d->column + (int)lround(2 * radius * cos(angle)),
            (chtype)(unsigned char)what);
}

static double degrees_of(int steps)
{
    return (double)steps / HEAD_STEPS_PER_DEGREE;
}

static void show_dial(const dial_t *d, const head_state_t *s)
{
    for (int degrees = (int)degrees_of(s->low_limit); degrees <= degrees_of(s->high_limit); degrees += RIM_DEGREES) {
        dial_put(d, degrees, RADIUS, '.');
    }
    dial_put(d, degrees_of(s->low_limit), RADIUS, '-');
    dial_put(d, degrees_of(s->high_limit), RADIUS, '+');
    dial_put(d, 0, RADIUS, '0');
    attron(A_BOLD);
    for (double radius = 1; radius < RADIUS; radius += 0.5) {
        dial_put(d, degrees_of(s->platform), radius, '#');
    }
    attroff(A_BOLD);
    mvaddch(d->row, d->column, 'o');
}

static void show_scale(int row, head_axis_t axis, const head_state_t *s)
{
    char low[8], high[8];
    int left, width;

    snprintf(low, sizeof low, "%d", s->low_limit);
    snprintf(high, sizeof high, "%d", s->high_limit);
    left = 4 + 5;
    width = COLS - left - 8;
    if (width < 10) {
        return;
    }
    mvprintw(row, 1, "%c %6s ", axis_letter[axis], low);
    mvhline(row, left + 1, '-', width);
    mvprintw(row, left + width + 2, "%s", high);
    for (int mark = 0; mark < 2; mark++) { /* the platform may hide the centre, and stand a little beyond the limits */
        int steps = (mark == 0 ? 0 : s->platform) - s->low_limit;
        long column = lround((double)steps * (width - 1) / (s->high_limit - s->low_limit));

        column = column < 0 ? 0 : column < width ? column : width - 1;
        mvaddch(row, left + 1 + (int)column, mark == 0 ? '|' : (chtype)'#' | A_BOLD);
    }
}

static void show_numbers(int row, head_axis_t axis, const screen_view_t *v)
{
    const head_state_t *s = v->axis[axis];
    char coils[] = "ABCD";

    for (int i = 0; i < 4; i++) {
        coils[i] = s->coils >> i & 1 ? coils[i] : '-';
    }
    mvprintw(row, 1, "%c %6d steps %7.1f deg  coils %s  sensor %-4s %7.1f steps/s  %llu made", axis_letter[axis],
             s->platform, degrees_of(s->platform), coils, s->sensor_low ? "low" : "high", v->rate[axis],
             (unsigned long long)s->steps);
}

static void show_warning(int row, const screen_view_t *v)
{
    move(row, 1);
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        const head_state_t *s = v->axis[axis];

        if (s->lost_steps > 0 || s->wrong_patterns > 0) {
            attron(A_REVERSE);
            printw(" %c: %llu steps lost, %llu wrong patterns ", axis_letter[axis], (unsigned long long)s->lost_steps,
                   (unsigned long long)s->wrong_patterns);
            attroff(A_REVERSE);
            addch(' ');
        }
    }
}

static void show_typed(int row, const char *typed)
{
    int room = COLS - 10;
    int length = (int)strlen(typed);

    if (room > 0) {
        mvprintw(row, 1, "typed: %s", typed + (length > room ? length - room : 0));
    }
}

void screen_show(const screen_view_t *v)
{
    bool drawn = LINES >= ROWS_WITH_DIALS && COLS >= COLUMNS_WITH_DIALS;
    int row = drawn ? BELOW_DIALS : DIAL_TITLE_ROW;

    erase();
    mvprintw(TITLE_ROW, 1, "Ninja on a simulated Nano %10.1f s", v->seconds);
    if (v->speed > 0) {
        printw("  %.2fx", v->speed);
    }
    if (v->help != NULL) {
        const char *line;

        for (unsigned i = 0; (line = v->help(i)) != NULL; i++) {
            mvaddstr(DIAL_TITLE_ROW + 1 + (int)i, 3, line);
        }
        row = DIAL_TITLE_ROW + 12;
    } else if (drawn) {
        static const dial_t azimuth = {DIAL_ROW + RADIUS, AZIMUTH_COLUMN, true};
        static const dial_t altitude = {DIAL_ROW + RADIUS, ALTITUDE_COLUMN, false};

        mvaddstr(DIAL_TITLE_ROW, AZIMUTH_COLUMN - 12, "X, azimuth, from above");
        mvaddstr(DIAL_TITLE_ROW, ALTITUDE_COLUMN - 10, "Y, altitude, from the side");
        show_dial(&azimuth, v->axis[HEAD_X]);
        show_dial(&altitude, v->axis[HEAD_Y]);
    }
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        show_scale(row++, axis, v->axis[axis]);
        show_numbers(row++, axis, v);
    }
    show_warning(row++, v);
    show_typed(row++, v->typed);
    mvaddnstr(row++, 1, v->notice, COLS - 2);
    mvaddnstr(row++, 1, "X Y V set, M S I move, C centre, P pause, ( ) R macro; Backspace halts, Ctrl-R resets", COLS - 2);
    mvaddnstr(row++, 1, "Ctrl-C or Ctrl-] q quits, Ctrl-] ? lists the keys", COLS - 2);
    refresh();
}
