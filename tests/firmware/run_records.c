/* A table and records on standard input, the core's records on standard output: a build of the core
 * as a process, for comparing builds byte for byte. */
#include "fw_record.h"

#include <stdio.h>

int main(void)
{
    static fw_core core;
    static fw_board board;
    static fw_record_in in;
    static fw_record_out out;
    if (fread(&board, sizeof board, 1, stdin) != 1 || !fw_init(&core, &board)) {
        return 1;
    }
    while (fread(&in, sizeof in, 1, stdin) == 1) {
        fw_record_tick(&core, &in, &out);
        if (fwrite(&out, sizeof out, 1, stdout) != 1) {
            return 2;
        }
    }
    return 0;
}
