#!/bin/sh
# Panels of columns of a table over its first column, seconds: each from 0 to the largest value of its curve.
#
#     scripts/chart.sh TABLE.csv "2:memory [kB]" "4:open files" > CHART.svg
set -eu
table="$1"
shift
panels=$(printf '%s\n' "$@")
PANELS="$panels" awk -F, '
    BEGIN {
        panels = split(ENVIRON["PANELS"], asked, "\n")
        for (p = 1; p <= panels; p++) { at = index(asked[p], ":"); column[p] = substr(asked[p], 1, at - 1); name[p] = substr(asked[p], at + 1) }
    }
    NR > 1 { x[++n] = $1; for (p = 1; p <= panels; p++) { y[p, n] = $column[p]; if ($column[p] + 0 > most[p]) most[p] = $column[p] + 0 } }
    END {
        height = 30 + 130 * panels
        printf "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 820 %d\" font-family=\"sans-serif\" font-size=\"13\">\n", height
        printf "<rect width=\"820\" height=\"%d\" fill=\"white\"/>\n", height
        # Of a long table every so many rows, so that a chart stays small.
        step = int(n / 1000) + 1
        for (p = 1; p <= panels; p++) {
            foot = 120 + 130 * (p - 1)
            printf "<text x=\"10\" y=\"%d\">%s: 0 … %d</text>\n", foot - 97, name[p], most[p]
            printf "<path d=\"M10 %d H810\" stroke=\"#bbb\"/>\n<polyline fill=\"none\" stroke=\"#06c\" points=\"", foot
            for (i = 1; i <= n; i += step) printf "%.1f,%.1f ", 10 + 800 * x[i] / x[n], foot - 90 * y[p, i] / (most[p] ? most[p] : 1)
            print "\"/>"
        }
        printf "<text x=\"10\" y=\"%d\">0 … %d s</text>\n</svg>\n", height - 15, x[n]
    }' "$table"
