/* What is judged in Python: lull/judge, started as the program that lies in lib/lull/modules beside the programs' bin. */
#ifndef GGN_CLI_JUDGE_H
#define GGN_CLI_JUDGE_H

/* Goes on as that program, with the command's own arguments; argv[0] is "ggn NAME". Returns only if it cannot be started:
 * the exit status, after one line on stderr. */
int ggn_cmd_judge(int argc, char **argv);

#endif
