/* The least that can answer TMCL on a pseudo-terminal: reads nine bytes, writes nine fixed bytes.
 * What a client gets done against this is the most it can get done against any server.
 * Prints the path of the port and runs until it is killed. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

enum { FRAME = 9 };

int main(void)
{
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) || unlockpt(master)) {
        perror("pseudo-terminal");
        return 1;
    }
    /* Kept open, so that a client may come and go. */
    int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    struct termios mode;
    if (slave < 0 || tcgetattr(slave, &mode)) {
        perror("slave side");
        return 1;
    }
    cfmakeraw(&mode);
    if (tcsetattr(slave, TCSANOW, &mode)) {
        perror("raw mode");
        return 1;
    }
    puts(ptsname(master));
    fflush(stdout);

    /* Host 2, module 1, status 100, command 6 (GAP), value 0. */
    unsigned char reply[FRAME] = { 2, 1, 100, 6, 0, 0, 0, 0, 2 + 1 + 100 + 6 };
    unsigned char request[FRAME];
    size_t have = 0;
    for (;;) {
        ssize_t got = read(master, request + have, FRAME - have);
        if (got <= 0)
            return 1;
        have += (size_t)got;
        if (have == FRAME) {
            have = 0;
            if (write(master, reply, FRAME) != FRAME)
                return 1;
        }
    }
}
