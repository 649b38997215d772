/* A driver without a fuzzer: reads every file that it is given, then bytes at random by a fixed seed.
 *   corpus RUNS FILE... */
#include "input.h"

static uint32_t seed = 2463534242u;

static uint8_t random_byte(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5; /* Marsaglia 2003, doi:10.18637/jss.v008.i14 */
    return (uint8_t)(seed >> 11);
}

int main(int count, char **words)
{
    static uint8_t data[1 << 16];
    const long runs = count > 1 ? strtol(words[1], NULL, 10) : 0;
    for (int i = 2; i < count; i++) {
        FILE *file = fopen(words[i], "rb");
        if (!file) {
            fprintf(stderr, "%s cannot be read\n", words[i]);
            return 2;
        }
        const size_t size = fread(data, 1, sizeof data, file);
        fclose(file);
        LLVMFuzzerTestOneInput(data, size);
    }
    for (long run = 0; run < runs; run++) {
        const size_t size = ((size_t)random_byte() << 3 | random_byte() % 8u) % 2048u;
        for (size_t i = 0; i < size; i++) data[i] = random_byte();
        LLVMFuzzerTestOneInput(data, size);
    }
    printf("%d files and %ld runs\n", count > 2 ? count - 2 : 0, runs);
    return 0;
}
