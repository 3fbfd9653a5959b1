$FOO 1
$
