/* Whether a board's table is possible: make -C firmware check-tables. TABLE is its path. */
#include TABLE

#include <stdio.h>

int main(void)
{
    const char *sentence = 0;
    const int problem = fw_board_problem(&board_table, &sentence);
    printf("%s: %s\n", TABLE, sentence);
    return problem != FW_BOARD_POSSIBLE;
}
